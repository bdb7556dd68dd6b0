// SPDX-License-Identifier: GPL-3.0-or-later
#include "import_opencv.h"

#include <Eigen/SVD>
#include <array>
#include <cctype>
#include <cmath>

namespace tenter {

namespace {

constexpr std::array kMatrixNames = {
    "cameramatrix", "intrinsicmatrix", "intrinsics", "k", "m", "mtx", "cm"};
constexpr std::array kDistortionNames = {
    "distortioncoefficients", "distcoeffs", "distcoeff", "distcoefs", "distortion", "dist", "d"};
constexpr std::array kRotationNames = {"r", "rotation", "rotationmatrix", "rmat", "rot"};
constexpr std::array kTranslationNames = {"t", "translation", "translationvector", "tvec", "trans"};

/// Lower case, without '_', '-' and blanks: "Camera_Matrix" and "cameraMatrix" are one name.
std::string plain(const std::string& name) {
  std::string out;
  for (const char c : name) {
    if (c != '_' && c != '-' && c != ' ') {
      out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  return out;
}

struct Named {
  std::string key;
  Eigen::MatrixXd value;
};
using PlainStorage = std::map<std::string, Named>;

template <std::size_t count>
const Named* find(const PlainStorage& storage, const std::array<const char*, count>& names,
                  const std::vector<std::string>& sides) {
  for (const char* name : names) {
    for (const std::string& side : sides) {
      for (const std::string& key : {name + side, side + name}) {
        const auto found = storage.find(key);
        if (found != storage.end()) return &found->second;
      }
    }
  }
  return nullptr;
}

std::optional<double> scalar(const PlainStorage& storage, const std::string& name) {
  const auto found = storage.find(name);
  if (found == storage.end() || found->second.value.size() != 1) return std::nullopt;
  return found->second.value(0, 0);
}

bool isSize(double value) { return value >= 1.0 && value <= 65536.0; }

/// Width and height if the file tells, under one of the names that programs use.
std::optional<std::pair<int, int>> sizeIn(const PlainStorage& storage) {
  for (const char* prefix : {"image", "img", "frame", "calibration", ""}) {
    const auto width = scalar(storage, std::string(prefix) + "width");
    const auto height = scalar(storage, std::string(prefix) + "height");
    if (width && height && isSize(*width) && isSize(*height)) {
      return std::pair(static_cast<int>(*width), static_cast<int>(*height));
    }
    for (const char* name : {"size", "resolution"}) {
      const auto found = storage.find(std::string(prefix) + name);
      if (found == storage.end() || found->second.value.size() != 2) continue;
      const double w = found->second.value(0), h = found->second.value(1);
      if (isSize(w) && isSize(h)) return std::pair(static_cast<int>(w), static_cast<int>(h));
    }
  }
  return std::nullopt;
}

Result<Lens> lensFrom(const Named& matrix, const Named* distortion, const std::string& file) {
  constexpr double kTiny = 1e-9;
  const Eigen::MatrixXd& k = matrix.value;
  if (k.rows() != 3 || k.cols() != 3) return badInput(file, matrix.key, "must be a 3 x 3 matrix");
  Lens lens{k(0, 0), k(1, 1), k(0, 2), k(1, 2), {}};
  if (!(std::abs(k(0, 1)) <= kTiny * std::abs(k(0, 0)))) {
    return badInput(file, matrix.key, "has skew, which the camera model has not");
  }
  const bool other_entries = std::abs(k(1, 0)) > kTiny || std::abs(k(2, 0)) > kTiny ||
                             std::abs(k(2, 1)) > kTiny || std::abs(k(2, 2) - 1.0) > kTiny;
  if (other_entries) return badInput(file, matrix.key, "is not a camera matrix");
  if (distortion == nullptr) return lens;
  const Eigen::VectorXd d = distortion->value.reshaped();
  if (d.size() > 14) return badInput(file, distortion->key, "has more than 14 coefficients");
  for (Eigen::Index i = 0; i < d.size(); ++i) {
    if (i < kDistortionTerms) {
      lens.distortion[static_cast<std::size_t>(i)] = d[i];
    } else if (d[i] != 0.0) {
      return badInput(file, distortion->key,
                      "has thin-prism or tilt terms, which the camera model has not",
                      "calibrate without CALIB_THIN_PRISM_MODEL and CALIB_TILTED_MODEL");
    }
  }
  return lens;
}

Result<CalibratedCamera> cameraFrom(const PlainStorage& storage, const std::string& name,
                                    const Named& matrix, const Named* distortion,
                                    const std::string& file,
                                    const CalibrationImportOptions& options,
                                    std::vector<std::string>& warnings) {
  const auto lens = lensFrom(matrix, distortion, file);
  if (!lens) return lens.error();
  auto size = options.size_px ? options.size_px : sizeIn(storage);
  if (!size) {
    // Lenses look through the middle of the sensor, nearly.
    const auto guess = [](double centre) {
      return static_cast<int>(std::clamp(std::round(2.0 * centre + 1.0), 1.0, 65536.0));
    };
    size = std::pair(guess(lens->cx_px), guess(lens->cy_px));
    warnings.push_back(name + ": the file does not tell the images' size; " +
                       std::to_string(size->first) + " x " + std::to_string(size->second) +
                       " is guessed from the principal point (--size says it)");
  }
  if (distortion == nullptr) warnings.push_back(name + ": no distortion is given; none is assumed");
  const auto model = CameraModel::make(size->first, size->second, *lens);
  if (!model) return badInput(file, matrix.key + ": " + model.error().place, model.error().reason);
  return CalibratedCamera{name, *model};
}

Result<Eigen::Isometry3d> relativePose(const Named& rotation, const Named& translation,
                                       double unit_m, const std::string& file) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  if (rotation.value.size() == 3) {
    const Vec3 vector = rotation.value.reshaped();
    if (vector.norm() > 0.0) {
      pose.linear() = Eigen::AngleAxisd(vector.norm(), vector.normalized()).toRotationMatrix();
    }
  } else if (rotation.value.rows() == 3 && rotation.value.cols() == 3) {
    const auto nearest = nearestRotation(rotation.value);
    if (!nearest) return badInput(file, rotation.key, "is not a rotation");
    pose.linear() = *nearest;
  } else {
    return badInput(file, rotation.key, "must be a 3 x 3 rotation or a rotation vector");
  }
  if (translation.value.size() != 3) {
    return badInput(file, translation.key, "must have three numbers");
  }
  pose.translation() = unit_m * Vec3(translation.value.reshaped());
  return pose;
}

}  // namespace

std::optional<Mat3> nearestRotation(const Mat3& matrix) {
  constexpr double kPrinted = 1e-3;
  const Eigen::JacobiSVD<Mat3> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Mat3 nearest = svd.matrixU() * svd.matrixV().transpose();
  if (!((nearest - matrix).norm() < kPrinted) || nearest.determinant() < 0.0) return std::nullopt;
  return nearest;
}

void warnOfUnit(CameraCalibration& c) {
  constexpr double kNear_m = 5e-3, kFar_m = 20.0;
  for (std::size_t i = 1; i < c.cameras.size(); ++i) {
    const double distance = baseline_m(c.cameras[0], c.cameras[i]);
    if (distance > kNear_m && distance < kFar_m) continue;
    c.warnings.push_back(c.cameras[i].name + " stands " + std::to_string(1e3 * distance) +
                         " mm from " + c.cameras[0].name + "; --unit says what lengths are in");
  }
}

Result<CameraCalibration> calibrationFromStorage(const Storage& raw, const std::string& file,
                                                 const CalibrationImportOptions& options) {
  PlainStorage storage;
  for (const auto& [key, value] : raw) storage[plain(key)] = {key, value.numbers};
  CameraCalibration c;
  c.source = "OpenCV";
  const std::vector<std::string> first = {"1", "left", "l", "0"}, second = {"2", "right", "r", "1"};
  const Named* one = find(storage, kMatrixNames, first);
  const Named* two = find(storage, kMatrixNames, second);
  if (one == two) two = nullptr;
  const bool stereo = one != nullptr && two != nullptr;
  if (!stereo && find(storage, kMatrixNames, {""}) != nullptr)
    one = find(storage, kMatrixNames, {""});
  if (one == nullptr) {
    return badInput(file, "", "has no camera matrix",
                    "names such as camera_matrix, K, or M1 and M2 are understood");
  }
  const Named* one_lens = find(storage, kDistortionNames,
                               stereo ? first : std::vector<std::string>{"", "1", "left", "l"});
  auto left =
      cameraFrom(storage, stereo ? "left" : "camera", *one, one_lens, file, options, c.warnings);
  if (!left) return left.error();
  c.cameras.push_back(std::move(*left));
  if (!stereo) return c;
  auto right = cameraFrom(storage, "right", *two, find(storage, kDistortionNames, second), file,
                          options, c.warnings);
  if (!right) return right.error();
  const Named* rotation = find(storage, kRotationNames, {""});
  const Named* translation = find(storage, kTranslationNames, {""});
  if (rotation == nullptr || translation == nullptr) {
    return badInput(file, rotation == nullptr ? "R" : "T", "is missing: how do the cameras stand?",
                    "OpenCV's samples keep it in extrinsics.yml; name both files");
  }
  const auto pose = relativePose(*rotation, *translation, options.unit_m, file);
  if (!pose) return pose.error();
  right->camera_from_world = *pose;
  c.cameras.push_back(std::move(*right));
  warnOfUnit(c);
  return c;
}

}  // namespace tenter
