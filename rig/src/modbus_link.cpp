// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/rig/modbus_link.h"

#include <modbus/modbus.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <thread>

#include "modbus_frames.h"

namespace tenter {
namespace {

constexpr int kSilencesBeforeReopening = 3;
// Drained for once, an answer that is later still is recognised by its length for so much longer.
constexpr int kSuspectLatencies = 10;

void sleepUntil(std::int64_t time_ns) {
  const std::int64_t rest_ns = time_ns - monotonic_ns();
  if (rest_ns > 0) std::this_thread::sleep_for(std::chrono::nanoseconds(rest_ns));
}

/// Whether bytes (or the end of the connection) wait before the deadline.
bool waitReadable(int descriptor, std::int64_t deadline_ns) {
  while (true) {
    const std::int64_t rest_ns = std::max<std::int64_t>(deadline_ns - monotonic_ns(), 0);
    const timespec timeout{rest_ns / 1'000'000'000, rest_ns % 1'000'000'000};
    pollfd entry{descriptor, POLLIN, 0};
    const int count = ppoll(&entry, 1, &timeout, nullptr);
    if (count > 0) return true;
    if (count == 0 || errno != EINTR) return false;
  }
}

void setTimeout(modbus_t* context, std::int64_t timeout_ns) {
  const std::int64_t timeout_us = std::max<std::int64_t>(timeout_ns / 1000, 1);
  modbus_set_response_timeout(context, static_cast<std::uint32_t>(timeout_us / 1'000'000),
                              static_cast<std::uint32_t>(timeout_us % 1'000'000));
}

}  // namespace

struct ModbusLink::Request {
  int unit = 0, function = 0;
  int count = 0;                    ///< Registers asked for, or written.
  std::vector<std::uint8_t> bytes;  ///< Unit, function, data.
};

std::int64_t rtuCharacter_ns(const ModbusAddress& address) {
  const int bits = 9 + (address.parity == 'N' ? 0 : 1) + address.stop_bits;
  return bits * std::int64_t{1'000'000'000} / address.baud;
}

std::int64_t rtuGap_ns(int baud) {
  constexpr std::int64_t kFixedGap_ns = 1'750'000;
  if (baud > 19200) return kFixedGap_ns;
  return std::int64_t{38'500'000'000} / baud;  // 3.5 characters of 11 bits
}

ModbusLink::ModbusLink(ModbusAddress address, ModbusTiming timing)
    : address_(std::move(address)), timing_(timing), back_off_ns_(timing.first_back_off_ns) {
  require(timing.response_timeout_ns > 0 && timing.longest_latency_ns >= 0,
          "a Modbus link needs a positive time-out");
}

ModbusLink::~ModbusLink() {
  if (context_ != nullptr) {
    modbus_close(context_);
    modbus_free(context_);
  }
}

bool ModbusLink::configure() {
  if (context_ != nullptr) return true;
  context_ = address_.tcp ? modbus_new_tcp(address_.host.c_str(), address_.port)
                          : modbus_new_rtu(address_.device.c_str(), address_.baud, address_.parity,
                                           8, address_.stop_bits);
  if (context_ == nullptr) return false;
  // Its own recovery never returns once the peer is gone, and with a time-out between bytes a
  // dribbling peer could keep a call for seconds.
  modbus_set_error_recovery(context_, MODBUS_ERROR_RECOVERY_NONE);
  modbus_set_byte_timeout(context_, 0, 0);
  return true;
}

bool ModbusLink::connect() {
  if (!configure()) return false;
  setTimeout(context_, timing_.response_timeout_ns);
  if (modbus_connect(context_) != 0) return false;
  descriptor_ = modbus_get_socket(context_);
  if (descriptor_ >= FD_SETSIZE) {  // libmodbus would write behind its descriptor set
    disconnect();
    return false;
  }
  ++generation_;
  silences_ = 0;
  return true;
}

void ModbusLink::disconnect() {
  if (context_ != nullptr) modbus_close(context_);
  descriptor_ = -1;
  next_connect_ns_ = monotonic_ns() + back_off_ns_;
  back_off_ns_ = std::min(2 * back_off_ns_, timing_.last_back_off_ns);
}

int ModbusLink::takeWaitingBytes() {
  std::array<std::uint8_t, 512> rest;
  int taken = 0;
  int waiting = 0;
  while (ioctl(descriptor_, FIONREAD, &waiting) == 0 && waiting > 0 && taken < 65536) {
    const ssize_t got = ::read(descriptor_, rest.data(), rest.size());
    if (got <= 0) break;
    taken += static_cast<int>(got);
  }
  return taken;
}

void ModbusLink::listenForLateBytes(std::int64_t until_ns, ModbusAnswer& answer) {
  while (monotonic_ns() < until_ns) {
    if (!waitReadable(descriptor_, until_ns)) return;
    if (takeWaitingBytes() == 0) {  // readable without bytes: the other end hung up
      disconnect();
      return;
    }
    answer.late_seen = true;
  }
}

bool ModbusLink::makeReady(ModbusAnswer& answer) {
  const std::int64_t now_ns = monotonic_ns();
  if (descriptor_ < 0) {
    answer.fault = LoadCellFault::kDisconnected;
    if (now_ns < next_connect_ns_) return false;
    if (!connect()) {
      disconnect();
      return false;
    }
    answer.fault = LoadCellFault::kNone;
  }
  if (quiet_until_ns_ > now_ns) {
    listenForLateBytes(std::min(quiet_until_ns_, now_ns + timing_.response_timeout_ns), answer);
    if (descriptor_ < 0) {
      answer.fault = LoadCellFault::kDisconnected;
      return false;
    }
    if (monotonic_ns() < quiet_until_ns_) {
      answer.fault = answer.late_seen ? LoadCellFault::kLateAnswer : LoadCellFault::kDraining;
      return false;
    }
  }
  return true;
}

bool ModbusLink::send(const Request& request) {
  const auto length = static_cast<int>(request.bytes.size());
  if (!address_.tcp) {
    modbus_set_slave(context_, request.unit);
    return modbus_send_raw_request(context_, request.bytes.data(), length) > 0;
  }
  // libmodbus gives raw requests no transaction number, so the header is written here.
  const std::vector<std::uint8_t> frame = tcpFrame(++transaction_, request.bytes);
  const ssize_t sent = ::send(descriptor_, frame.data(), frame.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  return sent == static_cast<ssize_t>(frame.size());
}

LoadCellFault ModbusLink::faultOfError(int error, const Request& request,
                                       std::span<const std::uint8_t> frame) const {
  switch (error) {
    case ETIMEDOUT:
      return LoadCellFault::kBrokenAnswer;
    case EMBBADCRC:
      return startsLikeEcho(request.bytes, frame) ? LoadCellFault::kEcho : LoadCellFault::kBadCrc;
    case EMBBADDATA:
      return LoadCellFault::kWrongFrame;
    default:
      return LoadCellFault::kDisconnected;
  }
}

LoadCellFault ModbusLink::receiveOnce(const Request& request, std::int64_t deadline_ns,
                                      std::span<std::uint16_t> words, ModbusAnswer& answer) {
  if (!waitReadable(descriptor_, deadline_ns)) {
    return answer.late_seen && address_.tcp ? LoadCellFault::kLateAnswer : LoadCellFault::kSilence;
  }
  setTimeout(context_, deadline_ns - monotonic_ns());
  std::array<std::uint8_t, MODBUS_MAX_ADU_LENGTH> frame{};
  const int length = modbus_receive_confirmation(context_, frame.data());
  if (length < 0) return faultOfError(errno, request, frame);
  if (length == 0) return LoadCellFault::kWrongUnit;  // RTU: libmodbus does not even check the CRC
  const std::span<const std::uint8_t> whole(frame.data(), static_cast<std::size_t>(length));
  AnswerFrame parts;
  if (address_.tcp) {
    if (!splitTcpFrame(whole, parts)) return LoadCellFault::kWrongFrame;
    if (parts.transaction != transaction_) {
      const auto behind = static_cast<std::uint16_t>(transaction_ - parts.transaction);
      return behind < 0x8000 ? LoadCellFault::kLateAnswer : LoadCellFault::kWrongFrame;
    }
  } else {
    parts = splitRtuFrame(whole);
  }
  return checkAnswer(request.bytes, request.count, parts, words, answer.exception_code);
}

LoadCellFault ModbusLink::receive(const Request& request, std::span<std::uint16_t> words,
                                  ModbusAnswer& answer) {
  const std::int64_t deadline_ns = answer.sent_ns + timing_.response_timeout_ns;
  while (true) {
    const LoadCellFault fault = receiveOnce(request, deadline_ns, words, answer);
    const bool skip_late =
        address_.tcp && fault == LoadCellFault::kLateAnswer && monotonic_ns() < deadline_ns;
    if (!skip_late) return fault;
    answer.late_seen = true;
  }
}

/// What a fault means for the connection and for the requests that follow.
void ModbusLink::settle(const Request& request, const ModbusAnswer& answer) {
  const std::int64_t now_ns = monotonic_ns();
  next_send_ns_ = now_ns + rtuGap_ns(address_.baud);
  silences_ = answer.fault == LoadCellFault::kSilence ? silences_ + 1 : 0;
  switch (answer.fault) {
    case LoadCellFault::kNone:
    case LoadCellFault::kException:
      back_off_ns_ = timing_.first_back_off_ns;
      return;
    case LoadCellFault::kDisconnected:
      disconnect();
      return;
    case LoadCellFault::kSilence:
      if (address_.tcp && silences_ >= kSilencesBeforeReopening) disconnect();
      break;
    case LoadCellFault::kBrokenAnswer:
    case LoadCellFault::kWrongFrame:
    case LoadCellFault::kTrailingBytes:
      if (address_.tcp) disconnect();  // where the next frame begins is unknown
      break;
    default:
      break;
  }
  if (address_.tcp) return;
  const bool was_the_answer = answer.fault == LoadCellFault::kBadCrc ||
                              answer.fault == LoadCellFault::kTrailingBytes ||
                              answer.fault == LoadCellFault::kEcho;
  quiet_until_ns_ =
      now_ns + (was_the_answer ? std::min(timing_.response_timeout_ns, timing_.longest_latency_ns)
                               : timing_.longest_latency_ns);
  if (was_the_answer) return;
  suspects_.push_back(
      {request.unit, request.count, now_ns + kSuspectLatencies * timing_.longest_latency_ns});
}

ModbusAnswer ModbusLink::exchange(const Request& request, std::span<std::uint16_t> words) {
  ModbusAnswer answer;
  if (!makeReady(answer)) return answer;
  if (!address_.tcp) sleepUntil(next_send_ns_);
  std::erase_if(suspects_, [now = monotonic_ns()](const auto& s) { return s.until_ns <= now; });
  if (takeWaitingBytes() > 0) {  // flushes, and unlike modbus_flush it tells and ends
    answer.late_seen = true;
    if (!address_.tcp) sleepUntil(monotonic_ns() + rtuGap_ns(address_.baud));
  }
  answer.sent_ns = monotonic_ns();
  answer.fault = send(request) ? receive(request, words, answer) : LoadCellFault::kDisconnected;
  const bool good = answer.fault == LoadCellFault::kNone;
  int waiting = 0;
  if (good && ioctl(descriptor_, FIONREAD, &waiting) == 0 && waiting > 0) {
    answer.fault = LoadCellFault::kTrailingBytes;
  }
  settle(request, answer);
  return answer;
}

ModbusAnswer ModbusLink::read(int unit, int function, int first, std::span<std::uint16_t> words) {
  require(!words.empty() && words.size() <= MODBUS_MAX_READ_REGISTERS && words.data() != nullptr,
          "a read asks for 1 to 125 registers");
  const auto count = static_cast<int>(words.size());
  std::array<std::uint16_t, MODBUS_MAX_READ_REGISTERS> taken{};
  const std::span<std::uint16_t> place(taken.data(), words.size());
  const Request request{unit, function, count, readRequest(unit, function, first, count)};
  const ModbusAnswer answer = exchange(request, place);
  if (answer.fault == LoadCellFault::kNone) std::copy(place.begin(), place.end(), words.begin());
  return answer;
}

ModbusAnswer ModbusLink::write(int unit, int function, int first,
                               std::span<const std::uint16_t> words) {
  const std::size_t most = function == MODBUS_FC_WRITE_SINGLE_REGISTER ? 1 : 123;
  require(!words.empty() && words.size() <= most, "too many or no registers to write");
  const Request request{unit, function, static_cast<int>(words.size()),
                        writeRequest(unit, function, first, words)};
  return exchange(request, {});
}

bool ModbusLink::isSuspect(int unit, int count) const {
  const std::int64_t now_ns = monotonic_ns();
  return std::any_of(suspects_.begin(), suspects_.end(), [&](const Suspect& suspect) {
    return suspect.unit == unit && suspect.count == count && suspect.until_ns > now_ns;
  });
}

}  // namespace tenter
