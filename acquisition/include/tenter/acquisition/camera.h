// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "tenter/acquisition/camera_config.h"

namespace tenter {

/// What may be wrong with the frame of one camera in one set.
enum class FrameFault {
  kNone,
  kNotConnected,   ///< Not opened, or gone.
  kSwapped,        ///< Another camera answers at its address.
  kNoAnswer,       ///< The camera did not confirm the trigger, or its driver does not come back.
  kNoFrame,        ///< Nothing came in time.
  kLostPackets,    ///< A part is missing.
  kStale,          ///< Taken before this set's trigger.
  kRepeatedFrame,  ///< The frame number of the one before.
  kFrozen,         ///< Pixel for pixel the image before.
  kSaturated,      ///< Too much of it is at the end of the scale.
  kBlurred,        ///< Far less sharp than this camera's images were.
};
/// "lost-packets", as in journals and answers.
std::string_view frameFaultName(FrameFault fault);
/// One sentence for a person.
std::string_view frameFaultText(FrameFault fault);
/// Whether there is no image, or one that must not be taken for this set's. Images of the other
/// faults are kept and marked.
bool isLost(FrameFault fault);

/// Pixels row by row without gaps; of two bytes each, low byte first, beyond 8 bits.
struct CameraImage {
  std::vector<std::uint8_t> pixels;
  int width_px = 0, height_px = 0;
  int bits = 8;  ///< Of a pixel; the end of the scale is 2^bits - 1.
  std::uint64_t frame_id = 0;
  std::int64_t camera_ns = 0;  ///< Time stamp by the camera's own clock.

  int bytesPerPixel() const { return bits > 8 ? 2 : 1; }
};

/// An image, or why there is none.
struct FrameOutcome {
  FrameFault fault = FrameFault::kNoFrame;
  std::string detail;  ///< What the driver says.
  CameraImage image;
};

struct CameraIdentity {
  std::string vendor, model, serial, address;
  int packet_bytes = 0;  ///< Negotiated; 0 where there are no packets.
};

/// Since the camera was opened.
struct CameraCounters {
  std::uint64_t completed = 0, failed = 0, underrun = 0;  ///< Frames.
  std::uint64_t resent = 0, missing = 0;                  ///< Packets.
};

/// One open camera, streaming. Of one thread. No call lasts longer than its time-out and that of
/// the camera's control channel, some seconds at most.
class Camera {
 public:
  virtual ~Camera() = default;
  virtual const CameraIdentity& identity() const = 0;
  /// Asks for one frame. Error: the camera did not confirm it.
  virtual Result<void> trigger() = 0;
  /// The next frame that arrives.
  virtual FrameOutcome next(std::chrono::milliseconds timeout) = 0;
  /// Throws away what has arrived.
  virtual void drain() = 0;
  virtual CameraCounters counters() const = 0;
  /// Whether the driver has noticed that the camera is gone.
  virtual bool gone() const = 0;
};

/// Opens a camera and has it stream. Error kind kHardware: why it cannot.
using CameraOpener =
    std::function<Result<std::unique_ptr<Camera>>(const CameraConfig&, const CameraSection&)>;

/// A camera that answers on some bus, opened or not.
struct FoundCamera {
  CameraIdentity identity;
  std::string protocol;  ///< "GigEVision", "USB3Vision".
};

/// Asks all networks and buses; takes a second or two.
std::vector<FoundCamera> discoverCameras();

/// Of GigE Vision and USB3 Vision cameras. A CameraOpener.
Result<std::unique_ptr<Camera>> openAravisCamera(const CameraConfig& config,
                                                 const CameraSection& section);

}  // namespace tenter
