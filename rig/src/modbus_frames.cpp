// SPDX-License-Identifier: GPL-3.0-or-later
#include "modbus_frames.h"

#include <algorithm>

namespace tenter {
namespace {

constexpr std::size_t kTcpHeader = 6;  // without the unit, which belongs to the body
constexpr std::size_t kCrcLength = 2;
constexpr std::size_t kEchoStart = 5;  // unit, function, address, high byte of the count
constexpr std::uint8_t kExceptionFlag = 0x80;

void append16(std::vector<std::uint8_t>& bytes, int word) {
  bytes.push_back(static_cast<std::uint8_t>(word >> 8));
  bytes.push_back(static_cast<std::uint8_t>(word));
}

int word16(std::span<const std::uint8_t> bytes, std::size_t at) {
  return bytes[at] << 8 | bytes[at + 1];
}

LoadCellFault checkRead(int count, std::span<const std::uint8_t> body,
                        std::span<std::uint16_t> words) {
  const std::size_t bytes = 2 * static_cast<std::size_t>(count);
  if (body.size() != 3 + bytes || body[2] != bytes) return LoadCellFault::kWrongCount;
  for (std::size_t i = 0; i < words.size(); ++i) {
    words[i] = static_cast<std::uint16_t>(word16(body, 3 + 2 * i));
  }
  return LoadCellFault::kNone;
}

/// Both kinds of confirmation repeat the first six bytes of the request.
LoadCellFault checkWrite(std::span<const std::uint8_t> request,
                         std::span<const std::uint8_t> body) {
  if (body.size() != 6) return LoadCellFault::kWrongCount;
  return std::equal(body.begin(), body.end(), request.begin()) ? LoadCellFault::kNone
                                                               : LoadCellFault::kWrongFrame;
}

}  // namespace

std::vector<std::uint8_t> readRequest(int unit, int function, int first, int count) {
  std::vector<std::uint8_t> bytes{static_cast<std::uint8_t>(unit),
                                  static_cast<std::uint8_t>(function)};
  append16(bytes, first);
  append16(bytes, count);
  return bytes;
}

std::vector<std::uint8_t> writeRequest(int unit, int function, int first,
                                       std::span<const std::uint16_t> words) {
  std::vector<std::uint8_t> bytes{static_cast<std::uint8_t>(unit),
                                  static_cast<std::uint8_t>(function)};
  append16(bytes, first);
  if (function == 16) {
    append16(bytes, static_cast<int>(words.size()));
    bytes.push_back(static_cast<std::uint8_t>(2 * words.size()));
  }
  for (const std::uint16_t word : words) append16(bytes, word);
  return bytes;
}

std::vector<std::uint8_t> tcpFrame(std::uint16_t transaction,
                                   std::span<const std::uint8_t> request) {
  std::vector<std::uint8_t> frame;
  append16(frame, transaction);
  append16(frame, 0);
  append16(frame, static_cast<int>(request.size()));
  frame.insert(frame.end(), request.begin(), request.end());
  return frame;
}

bool splitTcpFrame(std::span<const std::uint8_t> frame, AnswerFrame& parts) {
  if (frame.size() < kTcpHeader + 2 || word16(frame, 2) != 0) return false;
  parts.transaction = static_cast<std::uint16_t>(word16(frame, 0));
  parts.body = frame.subspan(kTcpHeader);
  return static_cast<std::size_t>(word16(frame, 4)) == parts.body.size();
}

AnswerFrame splitRtuFrame(std::span<const std::uint8_t> frame) {
  return {0, frame.first(frame.size() - std::min(kCrcLength, frame.size()))};
}

bool startsLikeEcho(std::span<const std::uint8_t> request, std::span<const std::uint8_t> frame) {
  const std::size_t length = std::min({kEchoStart, request.size(), frame.size()});
  return std::equal(request.begin(), request.begin() + static_cast<std::ptrdiff_t>(length),
                    frame.begin());
}

LoadCellFault checkAnswer(std::span<const std::uint8_t> request, int count,
                          const AnswerFrame& answer, std::span<std::uint16_t> words,
                          std::uint8_t& exception_code) {
  const std::span<const std::uint8_t> body = answer.body;
  if (body.size() < 3) return LoadCellFault::kWrongFrame;
  if (body[0] != request[0]) return LoadCellFault::kWrongUnit;
  if (body[1] == (request[1] | kExceptionFlag)) {
    exception_code = body[2];
    return LoadCellFault::kException;
  }
  if (body[1] != request[1]) return LoadCellFault::kWrongFunction;
  if (request[1] == 3 || request[1] == 4) return checkRead(count, body, words);
  return checkWrite(request, body);
}

}  // namespace tenter
