// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/calib/calibrate_cameras.h"

#include <cstdio>
#include <set>

#include "board_options.h"
#include "calibration_report.h"
#include "interrupt.h"
#include "output_guard.h"
#include "progress.h"
#include "verbs.h"

namespace tenter::app {

namespace {

struct Options {
  BoardOptions board;
  std::vector<std::string> cameras;
  std::string images, output;
  double max_rms_px = 0.5;
  bool flat_board = false;
  int rig_board = -1;
};

void declare(CLI::App& command, Options& o) {
  declareBoard(command, o.board);
  command
      .add_option("--camera", o.cameras,
                  "NAME or NAME=TEXT, TEXT for {camera} in --images; one a camera")
      ->required();
  command
      .add_option("--images", o.images,
                  "Pattern of the images' names, such as 'DIR/{camera}{index:02}.jpg'; images of "
                  "one index show the board in one pose")
      ->required();
  command
      .add_option("--max-rms-px", o.max_rms_px, "Reject a calibration whose corners miss by more")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  command.add_flag("--flat-board", o.flat_board,
                   "Take the board as flat; otherwise its warp is fitted");
  command
      .add_option("--rig-board", o.rig_board,
                  "Index of the images in which the board lies level in the rig's plane")
      ->check(CLI::NonNegativeNumber);
  command.add_option("-o,--output", o.output, "File of the calibration")->required();
}

Result<std::vector<CameraSource>> sourcesOf(const std::vector<std::string>& options) {
  std::vector<CameraSource> sources;
  std::set<std::string> names;
  for (const std::string& option : options) {
    const auto equals = option.find('=');
    CameraSource source{option.substr(0, equals),
                        equals == std::string::npos ? option : option.substr(equals + 1)};
    if (source.name.empty()) {
      return usageError("--camera: '" + option + "' has no name", "such as left=left");
    }
    if (!names.insert(source.name).second) {
      return usageError("--camera: two cameras are named '" + source.name + "'");
    }
    sources.push_back(std::move(source));
  }
  const bool same_files = sources.size() > 1 && sources[0].token == sources[1].token;
  if (same_files) return usageError("--camera: two cameras would read the same images");
  return sources;
}

/// The answer when no calibration came out: which images were left out, and why.
void reportNothing(const std::vector<CameraPhotos>& photos,
                   const std::vector<std::vector<RejectedImage>>& left_out, const Error& error,
                   Console& console) {
  auto& cameras = console.answer["cameras"] = nlohmann::json::array();
  for (std::size_t i = 0; i < photos.size(); ++i) {
    cameras.push_back({{"name", photos[i].name},
                       {"rms_px", nullptr},
                       {"accepted", 0},
                       {"rejected", rejectedJson(left_out[i])}});
    warnOfRejected(left_out[i], console);
  }
  console.answer["stereo_rms_px"] = nullptr;
  console.answer["baseline_m"] = nullptr;
  console.answer["verdict"] = "rejected";
  console.answer["reasons"] = {error.message()};
}

Result<int> run(const Options& o, Console& console) {
  const auto board = o.board.board();
  if (!board) return board.error();
  const auto sources = sourcesOf(o.cameras);
  if (!sources) return sources.error();
  if (auto free = checkOutputFile(o.output, kCalibrationMarker); !free) return free.error();

  Progress progress(console);
  const auto photos =
      gatherPhotos(o.images, *sources, *board, [&](double fraction, const std::string& name) {
        progress.show(fraction, name);
        return !interrupted();
      });
  if (!photos) return photos.error();
  progress.show(-1.0, "fitting");
  CameraCalibrationOptions options;
  options.max_rms_px = o.max_rms_px;
  options.fit_warp = !o.flat_board;
  if (o.rig_board >= 0) options.rig_index = o.rig_board;
  std::vector<std::vector<RejectedImage>> left_out;
  const auto calibration = calibrateCameras(*board, *photos, options, &left_out);
  if (!calibration) {
    reportNothing(*photos, left_out, calibration.error(), console);
    return calibration.error();
  }
  if (auto done = writeCalibration(o.output, *calibration); !done) return done.error();
  reportCalibration(*calibration, o.output, console);
  return calibration->accepted ? kDone : static_cast<int>(ErrorKind::kCalibrationRejected);
}

}  // namespace

Verb camerasCalibration() {
  return {"cameras", "Lenses and poses of cameras from images of a chessboard or ChArUco board",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, run); }};
}

}  // namespace tenter::app
