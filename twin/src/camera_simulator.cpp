// SPDX-License-Identifier: GPL-3.0-or-later
#include "camera_simulator.h"

#include <arv.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <opencv2/imgproc.hpp>

#include "loopback_scope.h"

namespace tenter {
namespace {

// Bootstrap registers of GigE Vision that the simulator has no call for.
constexpr guint32 kMacHigh = 0x0008, kMacLow = 0x000c, kUserName = 0x00e8,
                  kHeartbeatTimeout_ms = 0x0938;
constexpr std::size_t kUserName_bytes = 16;
/// Locally administered, and none of another simulator's.
constexpr guint32 kMacHighValue = 0x0200, kMacLowValue = 0x74770000;
/// While it makes an image a simulator hears nobody; that must not count as its controller's end.
constexpr guint32 kPatience_ms = 10'000;
/// How often a simulator looks whether it was triggered.
constexpr double kTicks_per_s = 1000.0;
constexpr double kTooMuchLight = 8.0, kNoise_rms = 1.0;

}  // namespace

struct CameraSimulator::Simulator {
  ~Simulator() {
    if (camera != nullptr) g_object_unref(camera);
  }
  ArvGvFakeCamera* camera = nullptr;
};

CameraSimulator::CameraSimulator(int index, std::string address,
                                 const VirtualCamerasOptions& options)
    : index_(index), address_(std::move(address)), options_(options) {}

CameraSimulator::~CameraSimulator() = default;

void CameraSimulator::seedLosses(std::uint64_t seed) {
  g_random_set_seed(static_cast<guint32>(seed));
}

bool CameraSimulator::plugIn() {
  const LoopbackScope scope(address_);
  auto simulator = std::make_unique<Simulator>();
  simulator->camera = arv_gv_fake_camera_new(address_.c_str(), serial().c_str());
  if (arv_gv_fake_camera_is_running(simulator->camera) == FALSE) return false;
  ArvFakeCamera* inner = arv_gv_fake_camera_get_fake_camera(simulator->camera);
  const auto width = static_cast<guint32>(options_.width_px);
  const auto height = static_cast<guint32>(options_.height_px);
  const std::array<std::pair<guint32, guint32>, 7> registers{
      {{ARV_FAKE_CAMERA_REGISTER_SENSOR_WIDTH, width},
       {ARV_FAKE_CAMERA_REGISTER_SENSOR_HEIGHT, height},
       {ARV_FAKE_CAMERA_REGISTER_WIDTH, width},
       {ARV_FAKE_CAMERA_REGISTER_HEIGHT, height},
       {kHeartbeatTimeout_ms, kPatience_ms},
       {kMacHigh, kMacHighValue},
       {kMacLow, kMacLowValue + static_cast<guint32>(index_) + 1}}};
  for (const auto& [place, value] : registers) {
    arv_fake_camera_write_register(inner, place, value);
  }
  std::array<char, kUserName_bytes> user_name{};
  const std::string text = name();
  std::copy_n(text.begin(), std::min(text.size(), user_name.size() - 1), user_name.begin());
  arv_fake_camera_write_memory(inner, kUserName, kUserName_bytes, user_name.data());
  frame_ = 0;
  arv_fake_camera_set_fill_pattern(
      inner,
      [](ArvBuffer* buffer, void* self, guint32 exposure_us, guint32 gain, ArvPixelFormat) {
        std::size_t size = 0;  // reads 0 until the frame is complete
        auto* pixels =
            static_cast<std::uint8_t*>(const_cast<void*>(arv_buffer_get_data(buffer, &size)));
        static_cast<CameraSimulator*>(self)->fill(arv_buffer_get_image_width(buffer),
                                                  arv_buffer_get_image_height(buffer), exposure_us,
                                                  gain, pixels);
      },
      this);
  arv_fake_camera_set_trigger_frequency(inner, kTicks_per_s);
  g_object_set(simulator->camera, "gvsp-lost-ratio", lost_share_, nullptr);
  simulator_ = std::move(simulator);
  return true;
}

void CameraSimulator::pullOut() { simulator_.reset(); }

void CameraSimulator::losePackets(double share) {
  lost_share_ = share;
  if (simulator_) g_object_set(simulator_->camera, "gvsp-lost-ratio", share, nullptr);
}

void CameraSimulator::fill(int width_px, int height_px, double exposure_us, double gain_dB,
                           std::uint8_t* pixels) {
  const std::span<std::uint8_t> image(
      pixels, static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px));
  const ImageRequest request{index_, name(), frame_++, width_px, height_px, exposure_us, gain_dB};
  if (frozen_ && last_.size() == image.size()) {
    std::copy(last_.begin(), last_.end(), image.begin());
    return;
  }
  options_.source->fill(request, image);
  if (overexposed_) expose(image, kTooMuchLight * kNominalExposure_us, 0.0);
  if (const double sigma_px = blur_px_; sigma_px > 0.0) {
    cv::Mat mat(height_px, width_px, CV_8UC1, pixels);
    cv::GaussianBlur(mat, mat, {0, 0}, sigma_px);
    addSensorNoise(image, kNoise_rms, request.frame);  // the sensor's own, which no lens blurs
  }
  last_.assign(image.begin(), image.end());
}

}  // namespace tenter
