// SPDX-License-Identifier: GPL-3.0-or-later
#include "capture.h"

#include <sched.h>
#include <unistd.h>

#include "daemon_log.h"

namespace tenter::daemon {
namespace {

using Json = nlohmann::ordered_json;

Json countersJson(const CameraCounters& counters) {
  return {{"completed", counters.completed},
          {"failed", counters.failed},
          {"underrun", counters.underrun},
          {"resent", counters.resent},
          {"missing", counters.missing}};
}

}  // namespace

CaptureService::CaptureService(CameraSection section)
    : bank_(std::move(section)), thread_([this] { run(); }) {}

CaptureService::~CaptureService() {
  {
    const std::lock_guard lock(mutex_);
    quitting_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

Result<void> CaptureService::awaitAll(std::chrono::milliseconds timeout) {
  if (!any() || bank_.awaitAll(timeout)) return {};
  for (const CameraStatus& camera : bank_.status()) {
    if (camera.connected) continue;
    return Error{ErrorKind::kHardware, "", camera.name, camera.fault,
                 "`tenter rig status` shows all cameras"};
  }
  return {};  // the last one has come meanwhile
}

void CaptureService::request(std::int64_t index, const std::shared_ptr<Recorder>& recorder) {
  const std::lock_guard lock(mutex_);
  if (wanted_) {
    recorder->append(
        steadyNow_ns(),
        FaultEvent{"cameras", "late", "capture " + std::to_string(index) + " was left out"});
    logEvent(LogLevel::kWarning, "fault",
             {{"source", "cameras"}, {"fault", "late"}, {"capture", index}});
    return;
  }
  wanted_ = Wanted{index, recorder, recorder->expectFrames()};
  changed_.notify_all();
}

void CaptureService::run() {
  // Coding and storing images must not come before what halts the rig, though the daemon be
  // real-time.
  const sched_param ordinary{};
  sched_setscheduler(gettid(), SCHED_OTHER, &ordinary);
  for (;;) {
    Wanted wanted;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return quitting_ || wanted_; });
      if (!wanted_) return;
      wanted = *std::exchange(wanted_, std::nullopt);
    }
    auto set = std::make_shared<FrameSet>(bank_.takeSet());
    {
      const std::lock_guard lock(mutex_);
      last_ = set;
      running_ = wanted.recorder;
    }
    record(*set, wanted);
  }
}

/// Images first, so that what is said of them stands behind their record.
void CaptureService::record(const FrameSet& set, const Wanted& wanted) {
  Recorder& recorder = *wanted.recorder;
  std::vector<std::string> names, pngs;
  for (std::size_t i = 0; i < set.frames.size(); ++i) {
    if (isLost(set.frames[i].fault)) continue;
    auto png = encodePng(set.frames[i].image);
    if (!png) continue;  // it then has no file, as one that was lost
    names.push_back(section().cameras[i].name);
    pngs.push_back(*std::move(png));
  }
  std::vector<FrameImage> images;
  for (std::size_t i = 0; i < names.size(); ++i) images.push_back({names[i], "png", pngs[i]});
  std::optional<std::int64_t> frame;
  if (!images.empty()) {
    if (const auto added = recorder.addFrame(set.time_ns, images)) frame = added->frame;
  }
  for (const SetEvent& event : set.events) {
    const std::string& name = section().cameras.at(static_cast<std::size_t>(event.camera)).name;
    const std::string text =
        "capture " + std::to_string(wanted.index) + ", take " + std::to_string(event.attempt + 1) +
        ": " + (event.detail.empty() ? std::string(frameFaultText(event.fault)) : event.detail);
    logEvent(LogLevel::kWarning, "fault",
             {{"source", name}, {"fault", frameFaultName(event.fault)}, {"text", text}});
    recorder.append(set.done_ns, FaultEvent{name, std::string(frameFaultName(event.fault)), text});
  }
  recorder.append(
      set.done_ns,
      GenericRecord{
          "frame-set",
          recordOf(set, wanted, frame).dump(-1, ' ', false, Json::error_handler_t::replace)});
}

Json CaptureService::recordOf(const FrameSet& set, const Wanted& wanted,
                              const std::optional<std::int64_t>& frame) const {
  Json cameras = Json::array(), frame_number, skew;
  const std::vector<CameraStatus> all = bank_.status();
  for (std::size_t i = 0; i < set.frames.size(); ++i) {
    const SetFrame& part = set.frames[i];
    Json row{{"name", section().cameras[i].name}, {"fault", frameFaultName(part.fault)}};
    if (!isLost(part.fault)) {
      row["frame_id"] = part.image.frame_id;
      row["camera_ns"] = part.image.camera_ns;
      row["trigger_ns"] = std::max<std::int64_t>(0, part.trigger_ns - wanted.recorder->start_ns());
      row["mean"] = part.quality.mean;
      row["saturated_share"] = part.quality.saturated_share;
      row["sharpness"] = part.quality.sharpness;
    }
    row["counters"] = countersJson(all[i].counters);
    cameras.push_back(std::move(row));
  }
  if (frame) frame_number = *frame;
  if (set.skew_ns) skew = *set.skew_ns;
  return {{"frame", frame_number},
          {"capture", wanted.index},
          {"retakes", set.retakes},
          {"skew_ns", skew},
          {"cameras", cameras}};
}

Result<std::shared_ptr<const FrameSet>> CaptureService::look() {
  if (!any()) {
    return Error{ErrorKind::kHardware, "", "cameras", "the rig's file names none",
                 "see docs/formats/rig.md"};
  }
  {
    const std::lock_guard lock(mutex_);
    const auto running = running_.lock();
    if (running && !running->closed() && last_) return last_;
  }
  return std::shared_ptr<const FrameSet>(std::make_shared<FrameSet>(bank_.takeSet()));
}

nlohmann::json CaptureService::status() const {
  nlohmann::json rows = nlohmann::json::array();
  for (const CameraStatus& camera : bank_.status()) {
    nlohmann::json row = countersJson(camera.counters);
    row["name"] = camera.name;
    row["connected"] = camera.connected;
    row["fault"] = camera.fault;
    row["serial"] = camera.identity.serial;
    row["address"] = camera.identity.address;
    row["packet_bytes"] = camera.identity.packet_bytes;
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace tenter::daemon
