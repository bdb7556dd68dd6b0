// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <atomic>
#include <cstring>

#include "discovery.h"
#include "glib_handles.h"
#include "pixel_formats.h"
#include "tenter/acquisition/camera.h"

namespace tenter {
namespace {

constexpr int kBuffers = 4;
constexpr int kSocketBuffer_bytes = 32 << 20;
/// How long the pieces of a frame may let wait for each other: busy senders pause in between.
constexpr unsigned kRetention_us = 500'000;

Error hardware(const std::string& camera, const std::string& reason,
               const std::string& advice = "") {
  return Error{ErrorKind::kHardware, "", camera, reason, advice};
}

FrameFault faultOf(ArvBufferStatus status) {
  switch (status) {
    case ARV_BUFFER_STATUS_SUCCESS:
      return FrameFault::kNone;
    case ARV_BUFFER_STATUS_TIMEOUT:
    case ARV_BUFFER_STATUS_MISSING_PACKETS:
    case ARV_BUFFER_STATUS_WRONG_PACKET_ID:
    case ARV_BUFFER_STATUS_SIZE_MISMATCH:
      return FrameFault::kLostPackets;
    default:
      return FrameFault::kNoFrame;
  }
}

class AravisCamera : public Camera {
 public:
  static Result<std::unique_ptr<Camera>> open(const CameraConfig& config,
                                              const CameraSection& section);
  ~AravisCamera() override;

  const CameraIdentity& identity() const override { return identity_; }
  Result<void> trigger() override;
  FrameOutcome next(std::chrono::milliseconds timeout) override;
  void drain() override;
  CameraCounters counters() const override;
  bool gone() const override { return gone_; }

 private:
  AravisCamera(const CameraConfig& config, GHandle<ArvCamera> camera)
      : config_(config), camera_(std::move(camera)) {}
  Result<void> identify(const std::string& opened);
  Result<void> configure(const CameraSection& section);
  Result<void> configureImage();
  Result<void> negotiatePackets(const CameraSection& section);
  Result<void> stream(const CameraSection& section);
  FrameOutcome imageOf(ArvBuffer* buffer) const;
  Error failure(const std::string& what, const GErrorSlot& error) const {
    return hardware(config_.name, what + ": " + error.message());
  }

  CameraConfig config_;
  CameraIdentity identity_;
  GHandle<ArvCamera> camera_;
  GHandle<ArvStream> stream_;
  bool streaming_ = false;
  std::atomic<bool> gone_{false};
};

Result<std::unique_ptr<Camera>> AravisCamera::open(const CameraConfig& config,
                                                   const CameraSection& section) {
  const auto name = openableName(config);
  if (!name) return name.error();
  GErrorSlot error;
  GHandle<ArvCamera> handle(arv_camera_new(name->c_str(), &error));
  if (!handle) {
    return hardware(config.name, "cannot be opened at " + *name + ": " + error.message(),
                    "is it switched on, and held by no other program?");
  }
  std::unique_ptr<AravisCamera> camera(new AravisCamera(config, std::move(handle)));
  if (auto done = camera->identify(*name); !done) return done.error();
  if (auto done = camera->configure(section); !done) return done.error();
  if (auto done = camera->stream(section); !done) return done.error();
  return std::unique_ptr<Camera>(std::move(camera));
}

AravisCamera::~AravisCamera() {
  // A camera that is gone confirms nothing, and each question would wait for its time-outs.
  if (streaming_ && !gone_) arv_camera_stop_acquisition(camera_.get(), nullptr);
  g_signal_handlers_disconnect_by_data(arv_camera_get_device(camera_.get()), &gone_);
}

Result<void> AravisCamera::identify(const std::string& opened) {
  GErrorSlot error;
  ArvDevice* device = arv_camera_get_device(camera_.get());
  g_signal_connect(device, "control-lost", G_CALLBACK(+[](ArvDevice*, void* gone) {
                     *static_cast<std::atomic<bool>*>(gone) = true;
                   }),
                   &gone_);
  identity_.address = opened;
  identity_.vendor = textOf(arv_camera_get_vendor_name(camera_.get(), &error));
  if (!error.failed()) identity_.model = textOf(arv_camera_get_model_name(camera_.get(), &error));
  if (!error.failed()) {
    identity_.serial = textOf(arv_camera_get_device_serial_number(camera_.get(), &error));
  }
  if (error.failed()) return failure("does not say what it is", error);
  return {};
}

Result<void> AravisCamera::configureImage() {
  GErrorSlot error;
  const PixelFormatRow* format = findPixelFormat(config_.pixel_format);
  arv_camera_set_pixel_format(camera_.get(), format->code, &error);
  if (error.failed()) return failure("does not take pixel_format " + config_.pixel_format, error);
  if (config_.width_px || config_.height_px) {
    int x = 0, y = 0, width = 0, height = 0;
    arv_camera_get_region(camera_.get(), &x, &y, &width, &height, &error);
    if (!error.failed()) {
      arv_camera_set_region(camera_.get(), 0, 0, config_.width_px.value_or(width),
                            config_.height_px.value_or(height), &error);
    }
    if (error.failed()) return failure("does not take width_px and height_px", error);
  }
  if (config_.exposure_us) {
    double least = 0.0, most = 0.0;
    arv_camera_get_exposure_time_bounds(camera_.get(), &least, &most, &error);
    if (!error.failed() && (*config_.exposure_us < least || *config_.exposure_us > most)) {
      return hardware(config_.name, "exposure_us is out of its range",
                      std::to_string(least) + " to " + std::to_string(most));
    }
    if (!error.failed()) {
      arv_camera_set_exposure_time(camera_.get(), *config_.exposure_us, &error);
    }
    if (error.failed()) return failure("does not take exposure_us", error);
  }
  if (config_.gain_dB) {
    arv_camera_set_gain(camera_.get(), *config_.gain_dB, &error);
    if (error.failed()) return failure("does not take gain_dB", error);
  }
  return {};
}

Result<void> AravisCamera::negotiatePackets(const CameraSection& section) {
  if (arv_camera_is_gv_device(camera_.get()) == FALSE) return {};
  GErrorSlot error;
  if (section.packet_bytes > 0) {
    arv_camera_gv_set_packet_size(camera_.get(), section.packet_bytes, &error);
  } else {
    arv_camera_gv_auto_packet_size(camera_.get(), &error);
  }
  if (error.failed()) return failure("agrees on no size of packets", error);
  identity_.packet_bytes = static_cast<int>(arv_camera_gv_get_packet_size(camera_.get(), &error));
  if (error.failed()) return failure("does not say the size of packets", error);
  return {};
}

Result<void> AravisCamera::configure(const CameraSection& section) {
  GErrorSlot error;
  arv_camera_stop_acquisition(camera_.get(), nullptr);  // a program that was killed left it going
  if (auto done = configureImage(); !done) return done;
  if (auto done = negotiatePackets(section); !done) return done;
  arv_camera_set_acquisition_mode(camera_.get(), ARV_ACQUISITION_MODE_CONTINUOUS, &error);
  if (!error.failed()) {
    arv_camera_set_trigger(camera_.get(),
                           section.hardware_trigger ? section.trigger_line.c_str() : "Software",
                           &error);
  }
  if (error.failed()) return failure("does not take the trigger", error);
  return {};
}

Result<void> AravisCamera::stream(const CameraSection& section) {
  GErrorSlot error;
  stream_.reset(arv_camera_create_stream(camera_.get(), nullptr, nullptr, &error));
  if (!stream_) return failure("gives no stream", error);
  if (ARV_IS_GV_STREAM(stream_.get())) {
    g_object_set(
        stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size",
        kSocketBuffer_bytes, "frame-retention", kRetention_us, "packet-resend",
        section.resend ? ARV_GV_STREAM_PACKET_RESEND_ALWAYS : ARV_GV_STREAM_PACKET_RESEND_NEVER,
        nullptr);
    if (!section.resend) {
      g_object_set(stream_.get(), "packet-timeout", kRetention_us, "initial-packet-timeout",
                   kRetention_us, nullptr);
    }
  }
  const std::size_t payload_bytes = arv_camera_get_payload(camera_.get(), &error);
  if (error.failed()) return failure("does not say how large its images are", error);
  for (int i = 0; i < kBuffers; ++i) {
    arv_stream_push_buffer(stream_.get(), arv_buffer_new_allocate(payload_bytes));
  }
  arv_camera_start_acquisition(camera_.get(), &error);
  if (error.failed()) return failure("does not start", error);
  streaming_ = true;
  return {};
}

Result<void> AravisCamera::trigger() {
  GErrorSlot error;
  arv_camera_software_trigger(camera_.get(), &error);
  if (error.failed()) return failure("does not take the trigger", error);
  return {};
}

FrameOutcome AravisCamera::next(std::chrono::milliseconds timeout) {
  const auto wait_us = std::chrono::microseconds(timeout).count();
  ArvBuffer* buffer = arv_stream_timeout_pop_buffer(
      stream_.get(), static_cast<guint64>(std::max<std::int64_t>(0, wait_us)));
  if (buffer == nullptr) return {FrameFault::kNoFrame, "", {}};
  FrameOutcome outcome = imageOf(buffer);
  arv_stream_push_buffer(stream_.get(), buffer);
  return outcome;
}

FrameOutcome AravisCamera::imageOf(ArvBuffer* buffer) const {
  FrameOutcome outcome;
  outcome.fault = faultOf(arv_buffer_get_status(buffer));
  if (outcome.fault != FrameFault::kNone) {
    outcome.detail = "status " + std::to_string(arv_buffer_get_status(buffer));
    return outcome;
  }
  CameraImage& image = outcome.image;
  const PixelFormatRow* format =
      findPixelFormat(static_cast<std::uint32_t>(arv_buffer_get_image_pixel_format(buffer)));
  std::size_t size_bytes = 0;
  const void* data = arv_buffer_get_image_data(buffer, &size_bytes);
  image.width_px = arv_buffer_get_image_width(buffer);
  image.height_px = arv_buffer_get_image_height(buffer);
  if (format != nullptr) image.bits = format->bits;
  const std::size_t wanted_bytes = static_cast<std::size_t>(std::max(0, image.width_px)) *
                                   static_cast<std::size_t>(std::max(0, image.height_px)) *
                                   static_cast<std::size_t>(image.bytesPerPixel());
  if (format == nullptr || data == nullptr || wanted_bytes == 0 || size_bytes < wanted_bytes) {
    return {FrameFault::kLostPackets, "the image is not of the size and format that it says", {}};
  }
  image.pixels.resize(wanted_bytes);
  std::memcpy(image.pixels.data(), data, wanted_bytes);
  image.frame_id = arv_buffer_get_frame_id(buffer);
  image.camera_ns = static_cast<std::int64_t>(arv_buffer_get_timestamp(buffer));
  return outcome;
}

void AravisCamera::drain() {
  while (ArvBuffer* buffer = arv_stream_try_pop_buffer(stream_.get())) {
    arv_stream_push_buffer(stream_.get(), buffer);
  }
}

CameraCounters AravisCamera::counters() const {
  CameraCounters counters;
  guint64 completed = 0, failed = 0, underrun = 0, resent = 0, missing = 0;
  arv_stream_get_statistics(stream_.get(), &completed, &failed, &underrun);
  if (ARV_IS_GV_STREAM(stream_.get())) {
    arv_gv_stream_get_statistics(ARV_GV_STREAM(stream_.get()), &resent, &missing);
  }
  return {completed, failed, underrun, resent, missing};
}

}  // namespace

Result<std::unique_ptr<Camera>> openAravisCamera(const CameraConfig& config,
                                                 const CameraSection& section) {
  return AravisCamera::open(config, section);
}

}  // namespace tenter
