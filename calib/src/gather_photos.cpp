// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <map>

#include "tenter/calib/byte_image.h"
#include "tenter/calib/calibrate_cameras.h"
#include "tenter/calib/image_sequence.h"

namespace tenter {

namespace {

using Size = std::pair<int, int>;
using Files = std::map<int, std::filesystem::path>;
using Progress = std::function<bool(double, const std::string&)>;

/// How many images are asked whether they show another board before the user is told.
constexpr std::size_t kAskedImages = 3;

std::string asText(const Size& size) {
  return std::to_string(size.first) + " x " + std::to_string(size.second);
}

/// One image's outcome.
struct Sight {
  std::string file;
  int index = 0;
  Size size{0, 0};
  Result<BoardCorners> corners;
};

Sight lookAt(const std::filesystem::path& file, int index, const Board& board) {
  const auto image = readByteImage(file);
  if (!image) return {file.string(), index, {0, 0}, image.error()};
  return {file.string(), index, {image->width, image->height}, detectBoard(*image, board)};
}

/// The size that most of a camera's readable images have; of equals the larger.
Size commonSize(const std::vector<Sight>& sights) {
  std::map<Size, int> votes;
  for (const Sight& sight : sights) {
    if (sight.size.first > 0) ++votes[sight.size];
  }
  Size best{0, 0};
  int most = 0;
  for (const auto& [size, count] : votes) {
    if (count >= most) {
      most = count;
      best = size;
    }
  }
  return best;
}

CameraPhotos sorted(const std::string& name, std::vector<Sight> sights) {
  CameraPhotos camera;
  camera.name = name;
  const Size size = commonSize(sights);
  camera.width_px = size.first;
  camera.height_px = size.second;
  for (Sight& sight : sights) {
    if (sight.size.first > 0 && sight.size != size) {
      camera.rejected.push_back(
          {sight.file,
           "is " + asText(sight.size) + " pixels, the camera's other images are " + asText(size)});
    } else if (!sight.corners.ok()) {
      camera.rejected.push_back({sight.file, sight.corners.error().reason});
    } else {
      camera.photos.push_back({std::move(sight.file), sight.index, std::move(*sight.corners)});
    }
  }
  return camera;
}

/// Error if images show a board with other counts; asked where most did not show the one wanted.
Result<void> checkCounts(const std::vector<CameraPhotos>& cameras, const Board& board) {
  if (board.kind != Board::Kind::kChessboard) return {};
  std::map<std::pair<int, int>, std::size_t> votes;
  std::size_t asked = 0;
  std::string example;
  const auto ask = [&](const std::string& file) {
    const auto image = readByteImage(file);
    if (!image) return;
    ++asked;
    const auto other = otherCornerCount(*image, board);
    if (!other) return;
    ++votes[*other];
    example = file;
  };
  for (const CameraPhotos& camera : cameras) {
    if (camera.rejected.size() <= camera.photos.size()) continue;
    for (std::size_t i = 0; i < camera.rejected.size() && i < kAskedImages; ++i) {
      ask(camera.rejected[i].image);
    }
  }
  for (const auto& [count, images] : votes) {
    if (2 * images <= asked) continue;
    return badInput(example, "",
                    "shows a chessboard of " + asText(count) + " inner corners, not " +
                        asText({board.columns, board.rows}),
                    "count the corners where four squares meet, one fewer than squares");
  }
  return {};
}

}  // namespace

Result<std::vector<CameraPhotos>> gatherPhotos(const std::string& pattern,
                                               const std::vector<CameraSource>& cameras,
                                               const Board& board, const Progress& progress) {
  std::vector<Files> files;
  std::size_t total = 0, done = 0;
  for (const CameraSource& camera : cameras) {
    auto found = findImages(pattern, camera.token);
    if (!found) return found.error();
    total += found->size();
    files.push_back(std::move(*found));
  }
  std::vector<CameraPhotos> out;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    std::vector<Sight> sights;
    for (const auto& [index, file] : files[i]) {
      const double fraction = static_cast<double>(done++) / static_cast<double>(total);
      if (progress && !progress(fraction, file.filename().string())) {
        return notConverged("stopped before all images were read");
      }
      sights.push_back(lookAt(file, index, board));
    }
    out.push_back(sorted(cameras[i].name, std::move(sights)));
  }
  if (auto ok = checkCounts(out, board); !ok) return ok.error();
  return out;
}

}  // namespace tenter
