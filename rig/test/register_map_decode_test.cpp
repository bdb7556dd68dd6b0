// SPDX-License-Identifier: GPL-3.0-or-later
#include "register_map_decode.h"

#include <gtest/gtest.h>

#include <vector>

#include "tenter/test_support/data.h"

namespace tenter {
namespace {

using Fault = LoadCellFault;
using Words = std::vector<std::uint16_t>;

RegisterMap shipped(const std::string& name) {
  return readRegisterMap(test_support::sourceFolder() / "rig/register-maps" / (name + ".toml"))
      .value();
}

DecodedWeights decode(const RegisterMap& map, const RegisterImage& image) {
  return decodeWeights(map, image, scaleOf(map, image).value());
}

/// Status and weights of a Laumas at 0.001 N a division (unit 4, index 15).
DecodedWeights laumas(std::uint16_t status, Words weights) {
  RegisterImage image;
  weights.insert(weights.begin(), status);
  image.put(6, weights);
  image.put(13, Words{0x040F});
  return decode(shipped("laumas-tlb"), image);
}

TEST(DecodeTest, LaumasMagnitudeTakesItsSignFromTheStatus) {
  const DecodedWeights positive = laumas(0x0800, {0x0001, 0x1171, 0x0000, 0x0C80});
  EXPECT_EQ(positive.fault, Fault::kNone);
  EXPECT_DOUBLE_EQ(positive.gross_N, 70.001);
  EXPECT_DOUBLE_EQ(positive.net_N, 3.2);
  EXPECT_TRUE(positive.stable);
  EXPECT_FALSE(positive.net_mode);
  const DecodedWeights negative = laumas(0x0580, {0, 1000, 0, 250});
  EXPECT_DOUBLE_EQ(negative.gross_N, -1.0);
  EXPECT_DOUBLE_EQ(negative.net_N, -0.25);
  EXPECT_FALSE(negative.stable);
  EXPECT_TRUE(negative.net_mode);
}

TEST(DecodeTest, LaumasTwosComplementIsTakenIfTheStatusAgrees) {
  EXPECT_DOUBLE_EQ(laumas(0x0080, {0xFFFF, 0xFC18, 0, 0}).gross_N, -1.0);
  EXPECT_EQ(laumas(0x0080, {0xFFFF, 0xFC18, 0, 0}).fault, Fault::kNone);
  EXPECT_EQ(laumas(0x0000, {0xFFFF, 0xFC18, 0, 0}).fault, Fault::kSignFlip);
}

TEST(DecodeTest, StatusBitsAreTyped) {
  EXPECT_EQ(laumas(0x0001, {0, 0, 0, 0}).fault, Fault::kCellError);
  EXPECT_EQ(laumas(0x0002, {0, 0, 0, 0}).fault, Fault::kConverterError);
  for (const int bit : {2, 3, 4, 5}) {
    EXPECT_EQ(laumas(static_cast<std::uint16_t>(1 << bit), {0, 0, 0, 0}).fault, Fault::kOverRange);
  }
  EXPECT_EQ(laumas(0x0003, {0, 0, 0, 0}).fault, Fault::kCellError);
}

TEST(DecodeTest, UnitsThatAreNoForceAndMissingRegistersHaveNoScale) {
  const RegisterMap map = shipped("laumas-tlb");
  RegisterImage image;
  EXPECT_EQ(scaleOf(map, image), std::nullopt);
  image.put(13, Words{0x050F});  // litres
  EXPECT_EQ(scaleOf(map, image), std::nullopt);
  image.put(13, Words{0x0413});  // division 19
  EXPECT_EQ(scaleOf(map, image), std::nullopt);
  image.put(13, Words{0x0012});  // kg, 0.0001
  EXPECT_DOUBLE_EQ(scaleOf(map, image)->newtons_per_count, 9.80665e-4);
}

/// Net 0.5, gross 0.75, tare 0.25 kg as floats.
RegisterImage seneca() {
  RegisterImage image;
  Words words(15);
  words[0] = 0x3F00;
  words[2] = 0x3F40;
  words[4] = 0x3E80;
  image.put(63, words);
  return image;
}

TEST(DecodeTest, SenecaFloats) {
  const RegisterMap map = shipped("seneca-ze-sg3");
  const DecodedWeights weights = decode(map, seneca());
  EXPECT_EQ(weights.fault, Fault::kNone);
  EXPECT_DOUBLE_EQ(weights.gross_N, 0.75 * 9.80665);
  EXPECT_DOUBLE_EQ(weights.net_N, 0.5 * 9.80665);
}

TEST(DecodeTest, NumbersThatAreNoneAndSumsThatFailAreNamed) {
  const RegisterMap map = shipped("seneca-ze-sg3");
  for (const std::uint16_t high : Words{0x7FC0, 0xFFC0, 0x7F80, 0xFF80}) {
    RegisterImage image = seneca();
    image.put(65, Words{high, 0});
    EXPECT_EQ(decode(map, image).fault, Fault::kNotANumber);
  }
  RegisterImage image = seneca();
  image.put(67, Words{0x3E90, 0});
  EXPECT_EQ(decode(map, image).fault, Fault::kInconsistent);
}

TEST(DecodeTest, DecimalsOfThePlainTransmitterComeFromItsStatus) {
  const RegisterMap map = shipped("rs485-transmitter");
  RegisterImage image;
  image.put(8, Words{0x0003});
  image.put(80, Words{0xFFFF, 0xFE0C, 0xFFFF, 0xFE0C, 0, 0});
  const DecodedWeights weights = decode(map, image);
  EXPECT_EQ(weights.fault, Fault::kNone);
  EXPECT_DOUBLE_EQ(weights.gross_N, -0.5 * 9.80665);
  EXPECT_TRUE(weights.stable);
  image.put(8, Words{0x0043});
  EXPECT_EQ(decode(map, image).fault, Fault::kOverRange);
}

}  // namespace
}  // namespace tenter
