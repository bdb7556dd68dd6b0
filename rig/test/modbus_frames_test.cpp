// SPDX-License-Identifier: GPL-3.0-or-later
#include "modbus_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

namespace tenter {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Fault = LoadCellFault;
using testing::ElementsAre;

TEST(ModbusFramesTest, RequestsAreThoseOfTheSpecification) {
  // Modbus Application Protocol V1.1b3: examples of functions 03, 06 and 16.
  EXPECT_THAT(readRequest(17, 3, 0x006B, 3), ElementsAre(17, 3, 0x00, 0x6B, 0x00, 0x03));
  const std::array<std::uint16_t, 2> words{0x000A, 0x0102};
  EXPECT_THAT(writeRequest(1, 16, 1, words),
              ElementsAre(1, 16, 0, 1, 0, 2, 4, 0x00, 0x0A, 0x01, 0x02));
  const std::array<std::uint16_t, 1> word{3};
  EXPECT_THAT(writeRequest(1, 6, 1, word), ElementsAre(1, 6, 0, 1, 0, 3));
  EXPECT_THAT(tcpFrame(0x1234, Bytes{17, 3}), ElementsAre(0x12, 0x34, 0, 0, 0, 2, 17, 3));
}

Fault check(const Bytes& body, std::uint8_t* code = nullptr) {
  std::array<std::uint16_t, 2> words{};
  std::uint8_t exception_code = 0;
  const Fault fault =
      checkAnswer(readRequest(1, 3, 100, 2), 2, AnswerFrame{0, body}, words, exception_code);
  if (code != nullptr) *code = exception_code;
  return fault;
}

TEST(ModbusFramesTest, EveryMismatchHasItsName) {
  EXPECT_EQ(check({1, 3, 4, 0, 1, 0, 2}), Fault::kNone);
  EXPECT_EQ(check({2, 3, 4, 0, 1, 0, 2}), Fault::kWrongUnit);
  EXPECT_EQ(check({1, 4, 4, 0, 1, 0, 2}), Fault::kWrongFunction);
  EXPECT_EQ(check({1, 3, 2, 0, 1}), Fault::kWrongCount);
  EXPECT_EQ(check({1, 3, 2, 0, 1, 0, 2}), Fault::kWrongCount);
  EXPECT_EQ(check({1, 3}), Fault::kWrongFrame);
  std::uint8_t code = 0;
  EXPECT_EQ(check({1, 0x83, 11}, &code), Fault::kException);
  EXPECT_EQ(code, 11);
}

TEST(ModbusFramesTest, TcpHeadersThatLieAreRefused) {
  AnswerFrame parts;
  EXPECT_TRUE(splitTcpFrame(Bytes{0, 9, 0, 0, 0, 3, 1, 0x83, 2}, parts));
  EXPECT_EQ(parts.transaction, 9);
  EXPECT_FALSE(splitTcpFrame(Bytes{0, 9, 0, 1, 0, 3, 1, 0x83, 2}, parts));
  EXPECT_FALSE(splitTcpFrame(Bytes{0, 9, 0, 0, 0, 4, 1, 0x83, 2}, parts));
  EXPECT_FALSE(splitTcpFrame(Bytes{0, 9, 0, 0}, parts));
}

TEST(ModbusFramesTest, AWriteMustComeBackAsItWentOut) {
  const std::array<std::uint16_t, 1> word{7};
  const Bytes request = writeRequest(1, 16, 5, word);
  std::uint8_t code = 0;
  const auto answer = [&](const Bytes& body) {
    return checkAnswer(request, 1, AnswerFrame{0, body}, {}, code);
  };
  EXPECT_EQ(answer({1, 16, 0, 5, 0, 1}), Fault::kNone);
  EXPECT_EQ(answer({1, 16, 0, 6, 0, 1}), Fault::kWrongFrame);
  EXPECT_EQ(answer({1, 16, 0, 5, 0}), Fault::kWrongCount);
}

TEST(ModbusFramesTest, AnEchoIsRecognisedByItsBeginning) {
  const Bytes request = readRequest(1, 3, 6, 5);
  EXPECT_TRUE(startsLikeEcho(request, Bytes{1, 3, 0, 6, 0}));
  EXPECT_FALSE(startsLikeEcho(request, Bytes{1, 3, 10, 6, 0, 1}));
}

}  // namespace
}  // namespace tenter
