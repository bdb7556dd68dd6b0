// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "load_cell_bench.h"
#include "tenter/rig/load_cell_scanner.h"

namespace tenter::load_cell_tests {
namespace {

using Fault = LoadCellFault;
using Kind = VirtualCellFaultKind;
using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;

constexpr double kTolerance_N = 0.02;  // six sigma of the noise, and a count

bool isGood(const LoadCellScanner& scanner, std::size_t cell) {
  return scanner.reading(cell).faultAt(monotonic_ns()) == Fault::kNone;
}

class EveryMapTest : public testing::TestWithParam<std::tuple<std::string, Wire>> {
 protected:
  static BenchOptions options() {
    BenchOptions options;
    options.map = std::get<0>(GetParam());
    options.wire = std::get<1>(GetParam());
    options.cells = 2;
    return options;
  }
};

TEST_P(EveryMapTest, ReadsBothCellsAndTaresOne) {
  Bench bench(options());
  bench.setForce(0, 4.25);
  bench.setForce(1, -0.125);
  const auto scanner = bench.startScanner();
  ASSERT_TRUE(waitFor([&] { return isGood(*scanner, 0) && isGood(*scanner, 1); }));
  EXPECT_NEAR(scanner->reading(0).last_gross_N, 4.25, kTolerance_N);
  EXPECT_NEAR(scanner->reading(0).last_net_N, 4.25, kTolerance_N);
  EXPECT_NEAR(scanner->reading(1).last_gross_N, -0.125, kTolerance_N);
  ASSERT_TRUE(scanner->command(0, "tare").ok());
  EXPECT_EQ(bench.cell(0).commands(), 1);
  EXPECT_EQ(bench.cell(1).commands(), 0);
  const std::uint64_t samples = scanner->reading(0).samples;
  ASSERT_TRUE(waitFor([&] { return scanner->reading(0).samples > samples + 2; }));
  // The limit of force is absolute: a tare must not move what it looks at.
  EXPECT_NEAR(scanner->reading(0).last_gross_N, 4.25, kTolerance_N);
  EXPECT_NEAR(scanner->reading(0).last_net_N, 0.0, kTolerance_N);
}

INSTANTIATE_TEST_SUITE_P(Maps, EveryMapTest,
                         testing::Combine(testing::Values("laumas-tlb", "seneca-ze-sg3",
                                                          "rs485-transmitter"),
                                          testing::Values(Wire::kTcp, Wire::kRtu)));

TEST(ScannerTest, ASilentAmplifierDoesNotDelayThoseOfOtherConnections) {
  Bench bench({.wire = Wire::kTcp, .cells = 2});
  bench.setForce(1, 2.0);
  const auto scanner = bench.startScanner();
  ASSERT_TRUE(waitFor([&] { return isGood(*scanner, 0) && isGood(*scanner, 1); }));
  bench.cell(0).inject({Kind::kSilence, 0, {}, 0});
  ASSERT_TRUE(waitFor([&] { return scanner->reading(0).fault == Fault::kSilence; }));
  const std::uint64_t failures = scanner->reading(1).failures;
  const std::uint64_t samples = scanner->reading(1).samples;
  ASSERT_TRUE(waitFor([&] { return scanner->reading(1).samples > samples + 50; }));
  EXPECT_EQ(scanner->reading(1).failures, failures);
  EXPECT_FALSE(scanner->reading(0).gross_N(monotonic_ns()).has_value());
}

TEST(ScannerTest, AReadingThatGetsNoYoungerBecomesStale) {
  LoadCellReading reading;
  reading.fault = Fault::kNone;
  reading.last_gross_N = 3.0;
  reading.stamp_ns = 1'000'000'000;
  reading.scan_ns = 5'000'000;
  EXPECT_EQ(reading.gross_N(1'010'000'000), 3.0);
  EXPECT_EQ(reading.gross_N(1'010'000'001), std::nullopt);
  EXPECT_EQ(reading.faultAt(1'010'000'001), Fault::kStale);
}

TEST(ScannerTest, ReconnectsWithBackOffWhenTheServerIsGoneForAWhile) {
  const auto map = shippedMap("laumas-tlb");
  VirtualCellOptions cell_options;
  cell_options.map = map;
  cell_options.force_N = [] { return 1.5; };
  const auto cell = std::make_shared<VirtualCell>(cell_options);
  auto server = VirtualModbus::serveTcp({{1, cell}}).value();
  LoadCellConfig config;
  config.id = "a";
  config.address = parseModbusAddress(server->address()).value();
  config.map = map;
  config.capacity_N = 50.0;
  const auto scanner = LoadCellScanner::start({config}).value();
  ASSERT_TRUE(waitFor([&] { return isGood(*scanner, 0); }));
  const int port = server->port();
  server.reset();
  ASSERT_TRUE(waitFor([&] { return scanner->reading(0).fault == Fault::kDisconnected; }));
  std::this_thread::sleep_for(milliseconds(300));
  VirtualTcpOptions same_port;
  same_port.port = port;
  server = VirtualModbus::serveTcp({{1, cell}}, same_port).value();
  EXPECT_TRUE(waitFor([&] { return isGood(*scanner, 0); }));
}

TEST(ScannerTest, AChangedDivisionIsNamedAndTheNewOneUsed) {
  BenchOptions options;
  options.wire = Wire::kTcp;
  Bench bench(options);
  bench.setForce(0, 2.0);
  std::atomic<bool> named{false};
  LoadCellScannerOptions scanner_options;
  scanner_options.on_event = [&](const LoadCellEvent& event) {
    if (event.fault == Fault::kScaleChanged) named = true;
  };
  const auto scanner = bench.startScanner(scanner_options);
  ASSERT_TRUE(waitFor([&] { return isGood(*scanner, 0); }));
  bench.cell(0).chooseScale(13);  // 0.005 N
  EXPECT_TRUE(waitFor([&] { return named.load(); }));
  EXPECT_TRUE(waitFor([&] { return isGood(*scanner, 0); }));
  EXPECT_NEAR(scanner->reading(0).last_gross_N, 2.0, kTolerance_N);
}

TEST(ScannerTest, ShowsSettingsAndRefusesCommandsThatTheAmplifierLacks) {
  BenchOptions options;
  options.map = "seneca-ze-sg3";
  Bench bench(options);
  const auto scanner = bench.startScanner();
  ASSERT_TRUE(waitFor([&] { return isGood(*scanner, 0); }));
  const auto settings = scanner->settings(0);
  ASSERT_TRUE(settings.ok());
  EXPECT_THAT(*settings, ElementsAre(Pair("adc-rate", "960 Hz")));
  const auto refused = scanner->command(0, "zero");
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().reason, HasSubstr("has no command \"zero\""));
}

TEST(ScannerTest, ACommandThatIsNotConfirmedIsAnError) {
  Bench bench({.wire = Wire::kTcp, .cells = 1});
  const auto scanner = bench.startScanner();
  ASSERT_TRUE(waitFor([&] { return isGood(*scanner, 0); }));
  bench.cell(0).inject({Kind::kException, 6, {}, 0});
  const auto refused = scanner->command(0, "tare");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().kind, ErrorKind::kHardware);
  EXPECT_THAT(refused.error().message(), HasSubstr("exception 6"));
}

TEST(ScannerTest, RefusesConfigurationsThatCannotBeMeant) {
  Bench bench({.wire = Wire::kTcp, .cells = 1});
  const auto start = [&](const std::function<void(LoadCellConfig&)>& change) {
    LoadCellConfig config = bench.configs()[0];
    change(config);
    return LoadCellScanner::start({config});
  };
  EXPECT_THAT(start([](auto& c) { c.unit = 0; }).error().message(), HasSubstr("unit"));
  EXPECT_THAT(start([](auto& c) { c.capacity_N = 0.0; }).error().message(), HasSubstr("capacity"));
  EXPECT_THAT(start([](auto& c) { c.map = nullptr; }).error().message(), HasSubstr("map"));
  const LoadCellConfig config = bench.configs()[0];
  EXPECT_THAT(LoadCellScanner::start({config, config}).error().message(),
              HasSubstr("same address"));
  EXPECT_FALSE(LoadCellScanner::start({}).ok());
}

}  // namespace
}  // namespace tenter::load_cell_tests
