// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/rig/load_cell.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <thread>

#include "load_cell_snapshot.h"

namespace tenter {
namespace {

using testing::HasSubstr;

TEST(LoadCellFaultTest, EveryFaultHasANameOfItsOwnAndASentence) {
  std::set<std::string_view> names;
  for (int i = 0; i < kLoadCellFaultCount; ++i) {
    const auto fault = static_cast<LoadCellFault>(i);
    EXPECT_TRUE(names.insert(loadCellFaultName(fault)).second);
    EXPECT_GT(loadCellFaultText(fault).size(), 10U);
  }
  EXPECT_EQ(loadCellFaultName(LoadCellFault::kStale), "stale");
  EXPECT_EQ(loadCellFaultName(LoadCellFault::kBadCrc), "bad-crc");
}

TEST(ModbusAddressTest, ReadsBothKindsAndWritesThemBack) {
  EXPECT_EQ(parseModbusAddress("tcp:10.0.0.5")->text(), "tcp:10.0.0.5:502");
  EXPECT_EQ(parseModbusAddress("tcp:127.0.0.1:1502")->port, 1502);
  EXPECT_EQ(parseModbusAddress("rtu:/dev/ttyUSB0")->text(), "rtu:/dev/ttyUSB0:115200:8N1");
  EXPECT_EQ(parseModbusAddress("rtu:/dev/ttyS1:9600:8E2")->text(), "rtu:/dev/ttyS1:9600:8E2");
}

TEST(ModbusAddressTest, RefusesOthersWithAnExample) {
  for (const char* text : {"", "tcp", "tcp:", "tcp:localhost", "tcp:1.2.3.4:0", "tcp:1.2.3.4:70000",
                           "tcp:1.2.3.4:5:6", "udp:1.2.3.4", "rtu:ttyUSB0", "rtu:/dev/x:abc",
                           "rtu:/dev/x:9600:7N1", "rtu:/dev/x:9600:8N1:1"}) {
    const auto address = parseModbusAddress(text);
    ASSERT_FALSE(address.ok()) << text;
    EXPECT_THAT(address.error().advice, HasSubstr("rtu:/dev/ttyUSB0"));
  }
}

TEST(SnapshotTest, ReadersNeverSeeHalfOfAValue) {
  struct Triple {
    std::uint64_t a = 0, b = 0, c = 0;
  };
  Snapshot<Triple> snapshot{Triple{}};
  std::atomic<bool> stop{false};
  std::thread writer([&] {
    for (std::uint64_t i = 1; !stop; ++i) snapshot.store({i, 3 * i, 7 * i});
  });
  std::uint64_t last = 0;
  for (int i = 0; i < 200'000; ++i) {
    const Triple value = snapshot.load();
    ASSERT_EQ(value.b, 3 * value.a);
    ASSERT_EQ(value.c, 7 * value.a);
    ASSERT_GE(value.a, last);
    last = value.a;
  }
  stop = true;
  writer.join();
}

}  // namespace
}  // namespace tenter
