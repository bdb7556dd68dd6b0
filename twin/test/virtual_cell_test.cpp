// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/twin/virtual_cell.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tenter/test_support/data.h"
#include "virtual_modbus_frames.h"

namespace tenter {
namespace {

using Kind = VirtualCellFaultKind;
using testing::ElementsAre;
using testing::HasSubstr;
using Words = std::vector<std::uint16_t>;

class VirtualCellTest : public testing::Test {
 protected:
  VirtualCellOptions options(const std::string& map) {
    const auto file = test_support::sourceFolder() / "rig/register-maps" / (map + ".toml");
    VirtualCellOptions options;
    options.map = std::make_shared<const RegisterMap>(readRegisterMap(file).value());
    options.force_N = [this] { return force_N_; };
    options.noise_N = 0.0;
    options.conversions_Hz = 0.0;
    return options;
  }
  static Words read(VirtualCell& cell, int first, int count) {
    Words words;
    EXPECT_EQ(cell.read(3, first, count, words), 0);
    return words;
  }
  double force_N_ = 0.0;
};

TEST_F(VirtualCellTest, LaumasRegistersAreThoseOfTheManual) {
  VirtualCell cell(options("laumas-tlb"));
  force_N_ = 70.001;
  read(cell, 6, 5);
  EXPECT_THAT(read(cell, 6, 5), ElementsAre(0x0800, 0x0001, 0x1171, 0x0001, 0x1171));
  EXPECT_THAT(read(cell, 13, 1), ElementsAre(0x040F));
  EXPECT_EQ(cell.write(16, 5, Words{7}), 0);
  EXPECT_THAT(read(cell, 6, 5), ElementsAre(0x0C00, 0x0001, 0x1171, 0, 0));
  force_N_ = 69.0;
  EXPECT_THAT(read(cell, 9, 2), ElementsAre(0, 1001));  // a magnitude
  EXPECT_EQ(read(cell, 6, 1)[0] & 0x0180, 0x0100);      // net is negative, gross is not
  EXPECT_EQ(cell.write(16, 5, Words{8}), 0);
  EXPECT_THAT(read(cell, 7, 2), ElementsAre(0, 0));
  EXPECT_EQ(cell.commands(), 2);
}

TEST_F(VirtualCellTest, RefusesAsTheAmplifierDoes) {
  VirtualCell cell(options("laumas-tlb"));
  Words words;
  EXPECT_EQ(cell.read(4, 6, 5, words), 1);
  EXPECT_EQ(cell.read(3, 500, 1, words), 2);
  EXPECT_EQ(cell.read(3, 0, 33, words), 3);
  EXPECT_EQ(cell.read(3, 0, 0, words), 3);
  EXPECT_EQ(cell.write(6, 5, Words{7}), 1);
  EXPECT_EQ(cell.write(16, 5, Words{4711}), 3);
}

TEST_F(VirtualCellTest, NoiseIsSeededAndHasTheWidthThatIsAsked) {
  VirtualCellOptions noisy = options("seneca-ze-sg3");
  noisy.noise_N = 0.003;
  VirtualCell one(noisy), same(noisy);
  noisy.seed = 2;
  VirtualCell other(noisy);
  double sum = 0.0, squares = 0.0;
  int differing = 0;
  constexpr int kReads = 4000;
  for (int i = 0; i < kReads; ++i) {
    const Words words = read(one, 65, 2);
    EXPECT_EQ(words, read(same, 65, 2));
    differing += words != read(other, 65, 2);
    const auto bits = static_cast<std::uint32_t>(words[0]) << 16 | words[1];
    const double force_N = 9.80665 * std::bit_cast<float>(bits);
    sum += force_N;
    squares += force_N * force_N;
  }
  EXPECT_GT(differing, kReads / 2);
  EXPECT_NEAR(sum / kReads, 0.0, 5.0 * 0.003 / std::sqrt(kReads));
  EXPECT_NEAR(std::sqrt(squares / kReads), 0.003, 0.0003);
}

TEST_F(VirtualCellTest, FaultsOfTheValueDoWhatTheirNamesSay) {
  VirtualCell cell(options("seneca-ze-sg3"));
  force_N_ = 9.80665;
  EXPECT_THAT(read(cell, 65, 2), ElementsAre(0x3F80, 0));
  cell.inject({Kind::kSignFlip, 0, {}, 1});
  cell.inject({Kind::kWordSwap, 0, {}, 1});
  cell.inject({Kind::kNotANumber, 0, {}, 1});
  cell.inject({Kind::kStuck, 0, {}, 0});
  EXPECT_THAT(read(cell, 65, 2), ElementsAre(0xBF80, 0));
  EXPECT_THAT(read(cell, 65, 2), ElementsAre(0, 0x3F80));
  EXPECT_THAT(read(cell, 65, 2), ElementsAre(0x7FC0, 0));
  EXPECT_TRUE(cell.hasFault());
  cell.clear();
  read(cell, 65, 2);
  cell.inject({Kind::kStuck, 0, {}, 2});
  force_N_ = 2 * 9.80665;
  EXPECT_THAT(read(cell, 65, 2), ElementsAre(0x3F80, 0));
  EXPECT_THAT(read(cell, 65, 2), ElementsAre(0x3F80, 0));
  EXPECT_THAT(read(cell, 65, 2), ElementsAre(0x4000, 0));
  EXPECT_FALSE(cell.hasFault());
}

TEST(VirtualCellFaultTest, NamesAreReadBack) {
  const std::vector<std::string> names = virtualCellFaultNames();
  EXPECT_THAT(names, testing::IsSupersetOf({"exception-1", "exception-6", "exception-11", "echo"}));
  for (const std::string& name : names) {
    EXPECT_EQ(virtualCellFaultName(parseVirtualCellFault(name).value()), name);
  }
  EXPECT_THAT(parseVirtualCellFault("exception-7").error().advice, HasSubstr("exception-6"));
  EXPECT_FALSE(canBefall(Kind::kBadCrc, true));
  EXPECT_TRUE(canBefall(Kind::kBadCrc, false));
}

TEST(VirtualModbusFramesTest, ChecksumIsThatOfTheSpecification) {
  // 02 07 41 12, the example of the serial-line guide; 01 03 00 00 00 0A C5 CD, known from manuals.
  EXPECT_EQ(modbusCrc(Bytes{0x02, 0x07}), 0x1241);
  EXPECT_EQ(modbusCrc(Bytes{1, 3, 0, 0, 0, 10}), 0xCDC5);
}

TEST(VirtualModbusFramesTest, RequestsAreTakenWholeOrNotAtAll) {
  Bytes input{1, 3, 0, 0, 0, 10, 0xC5};
  EXPECT_EQ(takeRtuRequest(input), std::nullopt);
  EXPECT_EQ(input.size(), 7U);
  input.push_back(0xCD);
  const auto request = takeRtuRequest(input);
  ASSERT_TRUE(request.has_value());
  EXPECT_EQ(request->unit, 1);
  EXPECT_THAT(request->pdu, ElementsAre(3, 0, 0, 0, 10));
  EXPECT_TRUE(input.empty());
  Bytes garbled{1, 3, 0, 0, 0, 10, 0xC5, 0xCE};
  EXPECT_EQ(takeRtuRequest(garbled), std::nullopt);
  EXPECT_TRUE(garbled.empty());
  bool broken = false;
  Bytes tcp{0, 1, 0, 0, 0, 6, 1, 3, 0, 0, 0, 1};
  EXPECT_EQ(takeTcpRequest(tcp, broken)->transaction, 1);
  Bytes lie{0, 1, 0, 9, 0, 6, 1, 3, 0, 0, 0, 1};
  EXPECT_EQ(takeTcpRequest(lie, broken), std::nullopt);
  EXPECT_TRUE(broken);
}

}  // namespace
}  // namespace tenter
