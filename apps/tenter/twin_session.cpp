// SPDX-License-Identifier: GPL-3.0-or-later
#include "twin_session.h"

#include <signal.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <thread>

#include "device_preload.h"
#include "interrupt.h"
#include "output_guard.h"
#include "protocol_files.h"
#include "rig_client.h"
#include "rig_snap.h"
#include "rig_visit.h"
#include "tenter/core/files.h"
#include "tenter/reconstruction/image_session.h"
#include "tenter/session/mounting.h"
#include "tenter/session/rest_pictures.h"
#include "tenter/twin/fabrics.h"
#include "tenter/twin/served_rig.h"

namespace tenter::app {

namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr auto kPoll = 50ms;
constexpr auto kBetweenLooks = 500ms;
constexpr auto kStart = 20s;     // until the daemon listens
constexpr auto kFarewell = 40s;  // longer than the daemon takes to unload
constexpr std::size_t kMaxFile_bytes = std::size_t{256} << 20;
constexpr std::string_view kMount = "mount.json", kTruth = "truth.jsonl", kLog = "tenterd.log",
                           kImages = "images.jsonl";

/// Where the rig keeps its files while it is served.
class StateFolder {
 public:
  static Result<std::unique_ptr<StateFolder>> make() {
    std::string name = (fs::temp_directory_path() / "tenter-rig-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) return badInput(name, "", "cannot be made");
    return std::unique_ptr<StateFolder>(new StateFolder(name));
  }
  ~StateFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  StateFolder(const StateFolder&) = delete;
  StateFolder& operator=(const StateFolder&) = delete;
  fs::path operator/(std::string_view name) const { return path_ / name; }
  const fs::path& path() const { return path_; }

 private:
  explicit StateFolder(fs::path path) : path_(std::move(path)) {}
  fs::path path_;
};

/// tenterd on a virtual bus. Ends it when it is left.
class Daemon {
 public:
  Daemon(const VirtualUsb& usb, const std::vector<std::string>& command, const fs::path& log)
      : log_(log) {
    auto child = usb.spawn(command, log);
    if (child) {
      pid_ = *child;
    } else {
      failure_ = child.error();
    }
  }
  ~Daemon() {
    if (pid_ <= 0) return;
    kill(pid_, SIGTERM);
    for (auto waited = 0ms; waited < kFarewell; waited += kPoll) {
      if (gone()) return;
      std::this_thread::sleep_for(kPoll);
    }
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;

  Result<void> awaitSocket(const fs::path& socket) {
    if (failure_) return *failure_;
    for (auto waited = 0ms; waited < kStart; waited += kPoll) {
      if (fs::is_socket(socket)) return {};
      if (gone()) break;
      std::this_thread::sleep_for(kPoll);
    }
    const auto said = readFile(log_, kMaxFile_bytes);
    return Error{ErrorKind::kHardware, "tenterd", "", "does not come up", said ? *said : ""};
  }

 private:
  bool gone() {
    if (pid_ > 0 && waitpid(pid_, nullptr, WNOHANG) == pid_) pid_ = -1;
    return pid_ <= 0;
  }

  fs::path log_;
  pid_t pid_ = -1;
  std::optional<Error> failure_;
};

/// The one that was built with this program, or else the one on the path.
std::string daemonProgram() {
  std::error_code failed;
  const fs::path beside = fs::read_symlink("/proc/self/exe", failed).replace_filename("tenterd");
  return !failed && fs::exists(beside) ? beside.string() : "tenterd";
}

const FolderKind& rigTruthFolder() {
  static const FolderKind kKind{std::string(kMount),
                                "\"protocol\"",
                                {std::string(kTruth), std::string(kLog), std::string(kImages)}};
  return kKind;
}

Result<void> keepTruth(const StateFolder& state, const std::string& folder) {
  return writeFolderAtomically(folder, rigTruthFolder(), [&](const fs::path& inside) {
    for (const std::string_view name : {kMount, kTruth, kLog, kImages}) {
      if (name == kImages && !fs::exists(state / name)) continue;  // no cameras
      const auto text = readFile(state / name, kMaxFile_bytes);
      if (!text) return Result<void>(text.error());
      if (auto done = writeFileAtomically(inside / name, *text); !done) return done;
    }
    return Result<void>();
  });
}

/// What the cameras look at, their calibration, and the sample at rest, where a session has them.
Result<void> keepScene(const StateFolder& state, const fs::path& session) {
  if (fs::exists(state / kRestFolder)) {
    if (auto kept = addRestPictures(session, state / kRestFolder); !kept) return kept.error();
  }
  for (const auto& [from, to] : {std::pair("mounting.json", kMountingFile),
                                 std::pair("calibration.json", kSessionCalibrationFile)}) {
    if (!fs::exists(state / from)) continue;
    const auto text = readFile(state / from, kMaxFile_bytes);
    if (!text) return text.error();
    std::error_code failed;
    fs::create_directories((session / to).parent_path(), failed);
    if (failed) return badInput((session / to).string(), "", failed.message());
    if (auto done = writeFileAtomically(session / to, *text); !done) return done;
  }
  return {};
}

Result<bool> allConnected(const std::string& socket) {
  const auto client = RigClient::connect(socket);
  if (!client) return client.error();
  const auto status = (*client)->call("status");
  if (!status) return status.error();
  const nlohmann::json cameras = status->value("cameras", nlohmann::json::array());
  return std::all_of(cameras.begin(), cameras.end(),
                     [](const nlohmann::json& camera) { return camera.value("connected", false); });
}

/// Pictures of the sample before it is hung, once all cameras are there.
Result<void> lookAtRest(const StateFolder& state, const std::string& socket,
                        const Console& console) {
  Console silent = console;
  silent.quiet = true;
  const fs::path folder = state / kRestFolder;
  const auto begin = std::chrono::steady_clock::now();
  while (true) {
    const auto ready = allConnected(socket);
    if (!ready) return ready.error();
    const bool late = std::chrono::steady_clock::now() - begin > kStart;
    if (*ready || late) {
      std::error_code ignored;
      fs::remove_all(folder, ignored);
      const auto taken = takeSnap(socket, folder.string(), silent);
      if (taken) return {};
      if (late) return taken.error();
    }
    std::this_thread::sleep_for(kBetweenLooks);
  }
}

Result<int> runProtocol(const SessionCapture& capture, const std::string& protocol,
                        const std::string& socket, Console& console) {
  const auto fabric = findFabric(capture.mount.fabric);
  if (!fabric) return fabric.error();
  const auto visit = RigVisit::begin(socket, console);
  if (!visit) return visit.error();
  const std::uint64_t piece =
      capture.mount.specimen != 0 ? capture.mount.specimen : capture.mount.seed;
  RigRun run;
  run.protocol_text = protocol;
  run.protocol_name = capture.mount.protocol;
  run.session = capture.output;
  run.fabric = capture.mount.fabric;
  run.specimen = capture.mount.fabric + "/" + std::to_string(piece);
  run.who = "virtual rig";
  run.operator_name = "tenter twin capture";
  run.areal_density_kg_per_m2 = (*fabric)->areal_density_kg_per_m2;
  return (*visit)->run(run);
}

}  // namespace

Result<int> captureSession(const SessionCapture& capture, Console& console) {
  if (auto free = checkNewFolder(capture.output); !free) return free.error();
  if (!capture.truth.empty()) {
    if (auto free = checkOutputFolder(capture.truth, rigTruthFolder()); !free) return free.error();
  }
  auto protocol = Result<std::string>(capture.protocol_text);
  if (protocol->empty()) protocol = protocolText(capture.mount.protocol);
  if (!protocol) return protocol.error();
  if (auto ready = preloadDevices(); !ready) return ready.error();
  const auto state = StateFolder::make();
  if (!state) return state.error();
  ServedRigOptions options;
  options.mount = capture.mount;
  options.state = (*state)->path();
  options.tcp = capture.tcp;
  if (auto added = addCameras(capture.cameras, options); !added) return added.error();
  const auto rig = ServedRig::start(options);
  if (!rig) return rig.error();
  const std::string socket = (**state / "tenterd.sock").string();
  Result<int> ended = kDone;
  {
    Daemon daemon((*rig)->usb(),
                  {daemonProgram(), "--config", (*rig)->configFile().string(), "--socket", socket,
                   "--end-with-parent"},
                  **state / kLog);
    if (auto up = daemon.awaitSocket(socket); !up) return up.error();
    if (options.scene) {
      if (auto seen = lookAtRest(**state, socket, console); !seen) return seen.error();
    }
    ended = runProtocol(capture, *protocol, socket, console);
  }
  if (!ended) return ended;
  if (auto kept = keepScene(**state, capture.output); !kept) return kept.error();
  if (!capture.truth.empty()) {
    if (auto kept = keepTruth(**state, capture.truth); !kept) return kept.error();
  }
  return ended;
}

}  // namespace tenter::app
