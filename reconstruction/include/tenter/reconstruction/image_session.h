// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tenter/reconstruction/camera_view.h"
#include "tenter/reconstruction/gray_image.h"
#include "tenter/session/mounting.h"
#include "tenter/session/session_reader.h"

namespace tenter {

/// One set of images and what the rig felt nearest to its moment.
struct SessionMoment {
  std::int64_t frame = 0, time_ns = 0;
  std::vector<std::optional<FrameFile>> files;  ///< One a view; nothing where there is none.
  SampleRecord sample;
  std::int64_t sample_apart_ns = 0;  ///< Of the sample from the images.
};

/// A session that cameras took part in, as a reconstruction needs it.
struct ImageSession {
  std::filesystem::path folder;
  SessionHeader header;
  Mounting mounting;
  CameraCalibration calibration;
  std::vector<CameraView> views;
  std::vector<SessionMoment> moments;  ///< In the order of their frames.
  /// Pictures of the sample as it lay flat before it was hung, if the session has a record of them.
  std::optional<std::vector<FrameFile>> rest_pictures;
  std::vector<std::string> warnings;
  std::string identity;  ///< Changes when the session or its calibration does.

  /// Place in `moments` of the reference: the frame at rest, or the first one.
  std::size_t reference = 0;
  bool at_rest = false;  ///< The reference shows the sample flat and is no frame of the test.
};

/// Error, naming file and reason: no such session, no images, no mounting or calibration, one that
/// is not that of the session's header, a calibration that does not know where the rig is, a camera
/// that is not calibrated, a frame at rest that is not there.
Result<ImageSession> openImageSession(const std::filesystem::path& folder);

/// Images of a moment. One that is missing, cannot be read, has another size than its camera or is
/// not the one that was recorded (SHA-256) stays empty, and `warnings` says which and why.
std::vector<GrayImage> readMoment(const ImageSession& session, const SessionMoment& moment,
                                  std::vector<std::string>& warnings);

/// What the first view shows in a frame, for a report; empty if it cannot be read.
GrayImage pictureOf(const ImageSession& session, std::int64_t frame);

}  // namespace tenter
