// SPDX-License-Identifier: GPL-3.0-or-later
// What recording costs: appends as a rig makes them, and how fast a session is read again. Give
// --benchmark_filter; the folder is the system's temporary one, so TMPDIR chooses the disk.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <thread>

#include "tenter/session/replay.h"
#include "tenter/session/session_reader.h"
#include "tenter/session/session_writer.h"

namespace tenter {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kChannels = 8;
constexpr std::chrono::milliseconds kPeriod{5};
constexpr int kHourOfSamples = 720'000;

SessionHeader header() {
  SessionHeader h;
  h.id = "bench";
  h.start_utc = "2026-01-01T00:00:00Z";
  h.areal_density_kg_per_m2 = 0.2;
  for (std::size_t i = 0; i < kChannels; ++i) {
    h.actuators.push_back("axis-" + std::to_string(i));
    h.cells.push_back("cell-" + std::to_string(i));
  }
  return h;
}

SampleRecord sample(int i) {
  SampleRecord record;
  for (std::size_t c = 0; c < kChannels; ++c) {
    const double number = 0.001 * i + 0.1 * static_cast<double>(c) / 3.0;
    record.positions_m.emplace_back(1e-3 * number);
    record.tensions.push_back({number, TensionStatus::kOk, 2'345'678});
  }
  return record;
}

/// A session in a temporary folder, gone at the end of the scope.
class Scratch {
 public:
  Scratch() {
    std::string name = (fs::temp_directory_path() / "tenter-bench-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot make " + name);
    folder_ = name;
    writer = std::move(SessionWriter::create(session(), header())).value();
  }
  ~Scratch() {
    writer.reset();
    fs::remove_all(folder_);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  fs::path session() const { return folder_ / "s"; }
  std::unique_ptr<SessionWriter> writer;

 private:
  fs::path folder_;
};

void BM_AppendSample(benchmark::State& state) {
  const Scratch scratch;
  const SampleRecord record = sample(7);
  for (auto _ : state) scratch.writer->append(0, record).value();
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_AppendSample);

void BM_AppendEvent(benchmark::State& state) {
  const Scratch scratch;
  for (auto _ : state) scratch.writer->append(0, StateChange{"Ready", "Running", ""}).value();
}
BENCHMARK(BM_AppendEvent)->UseRealTime();

/// 200 samples a second, as the rig makes them; how long each append keeps its caller.
void BM_AppendPaced(benchmark::State& state) {
  constexpr int kSamples = 1000;
  const Scratch scratch;
  std::vector<double> waits_us;
  for (auto _ : state) {
    auto due = Clock::now();
    for (int i = 0; i < kSamples; ++i) {
      std::this_thread::sleep_until(due += kPeriod);
      const auto begin = Clock::now();
      scratch.writer->append(0, sample(i)).value();
      waits_us.push_back(std::chrono::duration<double, std::micro>(Clock::now() - begin).count());
    }
  }
  std::sort(waits_us.begin(), waits_us.end());
  state.counters["p50_us"] = waits_us[waits_us.size() / 2];
  state.counters["p99_us"] = waits_us[waits_us.size() * 99 / 100];
  state.counters["max_us"] = waits_us.back();
}
BENCHMARK(BM_AppendPaced)->Iterations(1)->UseRealTime();

/// Replay and verification of an hour's samples.
void BM_ReadAnHour(benchmark::State& state) {
  const Scratch scratch;
  for (int i = 0; i < kHourOfSamples; ++i) {
    scratch.writer->append(i * std::chrono::nanoseconds(kPeriod).count(), sample(i)).value();
  }
  double replay_s = 0.0, verify_s = 0.0;
  for (auto _ : state) {
    EventLog log;
    replay_s = replaySession(scratch.session(), {}, log).value().wall_s;
    const auto begin = Clock::now();
    benchmark::DoNotOptimize(verifySession(scratch.session()).value());
    verify_s = std::chrono::duration<double>(Clock::now() - begin).count();
  }
  state.counters["replay_s"] = replay_s;
  state.counters["verify_s"] = verify_s;
  state.counters["journal_MB"] =
      1e-6 * static_cast<double>(fs::file_size(scratch.session() / "journal.jsonl"));
}
BENCHMARK(BM_ReadAnHour)->Iterations(1)->UseRealTime()->Unit(benchmark::kSecond);

}  // namespace
}  // namespace tenter

BENCHMARK_MAIN();
