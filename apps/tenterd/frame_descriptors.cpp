// SPDX-License-Identifier: GPL-3.0-or-later
#include "frame_descriptors.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace tenter::daemon {
namespace {

using Json = nlohmann::json;

bool writeAll(int descriptor, const std::vector<std::uint8_t>& bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t n = write(descriptor, bytes.data() + done, bytes.size() - done);
    if (n <= 0) return false;
    done += static_cast<std::size_t>(n);
  }
  return true;
}

}  // namespace

Descriptor::~Descriptor() {
  if (number_ >= 0) close(number_);
}

Result<Json> shareFrames(const FrameSet& set, const CameraSection& section,
                         std::vector<Descriptor>& descriptors) {
  Json rows = Json::array();
  for (std::size_t i = 0; i < set.frames.size(); ++i) {
    const SetFrame& frame = set.frames[i];
    Json row{{"name", section.cameras[i].name}, {"fault", frameFaultName(frame.fault)}};
    if (!isLost(frame.fault)) {
      Descriptor memory(memfd_create("tenter-frame", MFD_CLOEXEC | MFD_ALLOW_SEALING));
      if (memory.number() < 0 || !writeAll(memory.number(), frame.image.pixels) ||
          fcntl(memory.number(), F_ADD_SEALS,
                F_SEAL_WRITE | F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0) {
        return Error{ErrorKind::kHardware, "", "frames", std::strerror(errno), ""};
      }
      row["descriptor"] = descriptors.size();
      row["width_px"] = frame.image.width_px;
      row["height_px"] = frame.image.height_px;
      row["bits"] = frame.image.bits;
      row["size_bytes"] = frame.image.pixels.size();
      row["frame_id"] = frame.image.frame_id;
      row["mean"] = frame.quality.mean;
      row["saturated_share"] = frame.quality.saturated_share;
      row["sharpness"] = frame.quality.sharpness;
      descriptors.push_back(std::move(memory));
    }
    rows.push_back(std::move(row));
  }
  Json skew;
  if (set.skew_ns) skew = *set.skew_ns;
  return Json{
      {"time_ns", set.time_ns}, {"retakes", set.retakes}, {"skew_ns", skew}, {"frames", rows}};
}

}  // namespace tenter::daemon
