// SPDX-License-Identifier: GPL-3.0-or-later
// Programs of others: mbpoll and pymodbus read the virtual cells, and the client reads a server of
// pymodbus. mbpoll builds on libmodbus as the client does; pymodbus shares nothing with either.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <sstream>

#include "load_cell_bench.h"

namespace tenter::load_cell_tests {
namespace {

using testing::HasSubstr;

constexpr const char* kPython = "/usr/bin/python3";  // the one that Debian's modules belong to

std::string run(const std::string& command) {
  FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  std::string output;
  std::array<char, 512> buffer;
  while (pipe != nullptr && fgets(buffer.data(), buffer.size(), pipe) != nullptr) {
    output += buffer.data();
  }
  if (pipe != nullptr) pclose(pipe);
  return output;
}

std::string peer(const std::string& script) { return std::string(PEER_SCRIPTS) + "/" + script; }

/// A port that nobody serves at the moment.
int freePort() {
  BenchOptions options;
  const Bench bench(options);
  return parseModbusAddress(bench.configs()[0].address.text()).value().port;
}

/// A script that serves until the destructor ends it.
class PeerServer {
 public:
  PeerServer(const std::string& script, const std::vector<std::string>& arguments) {
    std::array<int, 2> ends{};
    if (pipe(ends.data()) != 0) return;
    process_ = fork();
    if (process_ == 0) {
      dup2(ends[1], STDOUT_FILENO);
      std::vector<std::string> words{kPython, script};
      words.insert(words.end(), arguments.begin(), arguments.end());
      std::vector<char*> pointers;
      pointers.reserve(words.size() + 1);
      for (std::string& word : words) pointers.push_back(word.data());
      pointers.push_back(nullptr);
      execv(kPython, pointers.data());
      _exit(127);
    }
    close(ends[1]);
    FILE* output = fdopen(ends[0], "r");
    std::array<char, 256> line{};
    if (fgets(line.data(), line.size(), output) != nullptr) first_line_ = line.data();
    fclose(output);
    if (!first_line_.empty()) first_line_.pop_back();
  }
  ~PeerServer() {
    if (process_ <= 0) return;
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
  }
  PeerServer(const PeerServer&) = delete;
  PeerServer& operator=(const PeerServer&) = delete;
  const std::string& firstLine() const { return first_line_; }

 private:
  pid_t process_ = -1;
  std::string first_line_;
};

BenchOptions exactBench(const std::string& map, Wire wire) {
  BenchOptions options;
  options.map = map;
  options.wire = wire;
  options.noise_N = 0.0;
  return options;
}

std::string mbpoll(const Bench& bench, const std::string& what) {
  const ModbusAddress address = bench.configs()[0].address;
  if (address.tcp) {
    return run("mbpoll -m tcp -p " + std::to_string(address.port) + " -a 1 -0 -1 " + what + " " +
               address.host);
  }
  return run("mbpoll -m rtu -b 115200 -P none -a 1 -0 -1 " + what + " " + address.device);
}

class PeerTest : public testing::TestWithParam<Wire> {};

TEST_P(PeerTest, MbpollReadsTheRegistersOfALaumas) {
  Bench bench(exactBench("laumas-tlb", GetParam()));
  bench.setForce(0, 3.2);
  const std::string gross_and_net = mbpoll(bench, "-t 4:int -B -r 7 -c 2");
  EXPECT_THAT(gross_and_net, HasSubstr("[7]: \t3200\n"));
  EXPECT_THAT(gross_and_net, HasSubstr("[9]: \t3200\n"));
  bench.setForce(0, -0.25);
  EXPECT_THAT(mbpoll(bench, "-t 4:int -B -r 7 -c 1"), HasSubstr("[7]: \t250\n"));
  // Gross and net negative.
  EXPECT_THAT(mbpoll(bench, "-t 4:hex -r 6 -c 1"), HasSubstr("[6]: \t0x0980\n"));
  // Newton, division 15.
  EXPECT_THAT(mbpoll(bench, "-t 4:hex -r 13 -c 1"), HasSubstr("[13]: \t0x040F\n"));
}

TEST_P(PeerTest, MbpollReadsTheFloatsOfASeneca) {
  Bench bench(exactBench("seneca-ze-sg3", GetParam()));
  bench.setForce(0, 0.5 * 9.80665);
  const std::string weights = mbpoll(bench, "-t 4:float -B -r 63 -c 3");
  EXPECT_THAT(weights, HasSubstr("[63]: \t0.5\n"));
  EXPECT_THAT(weights, HasSubstr("[65]: \t0.5\n"));
  EXPECT_THAT(weights, HasSubstr("[67]: \t0\n"));
}

TEST_P(PeerTest, PymodbusReadsAndTaresALaumas) {
  Bench bench(exactBench("laumas-tlb", GetParam()));
  bench.setForce(0, 70.001);  // 0x00011171 counts, both words in use
  const ModbusAddress address = bench.configs()[0].address;
  const std::string place =
      address.tcp ? "tcp:" + std::to_string(address.port) : "rtu:" + address.device;
  std::istringstream output(run(std::string(kPython) + " " + peer("read_laumas.py") + " " + place));
  std::string before, after;
  std::getline(output, before);
  std::getline(output, after);
  // Beyond 50 N the status says so with bit 2; the first conversion is not a stable one, bit 11.
  EXPECT_EQ(before, "[4, 1, 4465, 1, 4465]") << output.str();
  EXPECT_EQ(after, "[3076, 1, 4465, 0, 0]") << output.str();
}

TEST_P(PeerTest, TheClientReadsAServerOfPymodbus) {
  const bool tcp = GetParam() == Wire::kTcp;
  const std::string where = tcp ? "tcp:" + std::to_string(freePort()) : "rtu";
  const PeerServer server(peer("serve_seneca.py"), {where, "1.5", "0.25"});
  ASSERT_FALSE(server.firstLine().empty());
  LoadCellConfig config;
  config.id = "peer";
  config.address =
      parseModbusAddress(tcp ? "tcp:127.0.0.1:" + server.firstLine() : "rtu:" + server.firstLine())
          .value();
  config.map = shippedMap("seneca-ze-sg3");
  config.capacity_N = 50.0;
  config.stuck_after = std::chrono::milliseconds(0);
  config.response_timeout = std::chrono::milliseconds(200);  // Python's, not an amplifier's
  const auto scanner = LoadCellScanner::start({config}).value();
  ASSERT_TRUE(
      waitFor([&] { return scanner->reading(0).samples > 20; }, std::chrono::milliseconds(15000)))
      << loadCellFaultName(scanner->reading(0).fault);
  EXPECT_NEAR(scanner->reading(0).last_gross_N, 1.5 * 9.80665, 1e-6);
  EXPECT_NEAR(scanner->reading(0).last_net_N, 1.25 * 9.80665, 1e-6);
  EXPECT_TRUE(scanner->reading(0).stable);
}

INSTANTIATE_TEST_SUITE_P(Wires, PeerTest, testing::Values(Wire::kTcp, Wire::kRtu));

}  // namespace
}  // namespace tenter::load_cell_tests
