// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <numbers>

#include "import_opencv.h"
#include "number_list.h"

namespace tenter {

namespace {

constexpr int kMostCameras = 10;

/// Parameters of one Teuchos list, with the file and the list's name for errors.
struct List {
  const XmlElement& element;
  const std::string& file;
  std::string name;

  std::optional<std::string> text(const std::string& key) const {
    for (const XmlElement& child : element.children) {
      if (child.name == "Parameter" && child.attribute("name") == key) {
        return child.attribute("value");
      }
    }
    return std::nullopt;
  }
  const XmlElement* sublist(const std::string& key) const {
    for (const XmlElement& child : element.children) {
      if (child.name == "ParameterList" && child.attribute("name") == key) return &child;
    }
    return nullptr;
  }
  Error wrong(const std::string& key, const std::string& reason,
              const std::string& advice = "") const {
    return badInput(file, name.empty() ? key : name + "." + key, reason, advice);
  }
};

/// Reads numbers and keeps the first error.
class Numbers {
 public:
  explicit Numbers(const List& list) : list_(list) {}
  /// Absent parameters are zero in this format.
  double operator()(const std::string& key) {
    const auto text = list_.text(key);
    if (!text) return 0.0;
    const auto values = parseNumbers(*text);
    if (values && values->size() == 1) return values->front();
    if (!error_) error_ = list_.wrong(key, "must be a finite number");
    return 0.0;
  }
  const std::optional<Error>& error() const { return error_; }

 private:
  const List& list_;
  std::optional<Error> error_;
};

struct Intrinsics {
  double fx, fy, cx, cy, fs;
  std::array<double, 6> k;
  std::array<double, 2> p;
  std::array<double, 4> s;
  std::array<double, 2> t;
};

bool anyNonZero(std::initializer_list<double> values) {
  for (const double value : values) {
    if (value != 0.0) return true;
  }
  return false;
}

/// Each converts what its lens model means to `Lens`, or says why that cannot be.
using Converter = Result<Lens> (*)(const Intrinsics&, const List&);

Result<Lens> withoutDistortion(const Intrinsics& i, const List& /*list*/) {
  return Lens{i.fx, i.fy, i.cx, i.cy, {}};
}

Result<Lens> openCvLens(const Intrinsics& i, const List& list) {
  if (anyNonZero({i.s[0], i.s[1], i.s[2], i.s[3], i.t[0], i.t[1]})) {
    return list.wrong("S1", "thin-prism or tilt terms are not zero; the camera model has none");
  }
  return Lens{
      i.fx, i.fy, i.cx, i.cy, {i.k[0], i.k[1], i.p[0], i.p[1], i.k[2], i.k[3], i.k[4], i.k[5]}};
}

/// r + k1 r + k2 r^2 + k3 r^3: the first term is a factor of the focal length.
Result<Lens> firstSecondThird(const Intrinsics& i, const List& list) {
  if (i.k[1] != 0.0)
    return list.wrong("K2", "an even power of the radius; the camera model has none");
  const double factor = 1.0 + i.k[0];
  if (!(factor > 0.0)) return list.wrong("K1", "turns the image inside out");
  return Lens{i.fx * factor, i.fy * factor, i.cx, i.cy, {i.k[2] / factor, 0, 0, 0, 0, 0, 0, 0}};
}

Result<Lens> evenPowers(const Intrinsics& i, const List& list) {
  if (anyNonZero({i.k[0], i.k[1], i.k[2]})) {
    return list.wrong("K1", "even powers of the radius; the camera model has none");
  }
  return withoutDistortion(i, list);
}

/// r + k1 r^3 + k2 r^5 + k3 r^7.
Result<Lens> oddPowers(const Intrinsics& i, const List& /*list*/) {
  return Lens{i.fx, i.fy, i.cx, i.cy, {i.k[0], i.k[1], 0, 0, i.k[2], 0, 0, 0}};
}

Result<Lens> vicLens(const Intrinsics& i, const List& list) {
  if (anyNonZero({i.k[0], i.k[1], i.k[2], i.fs})) {
    return list.wrong("K1", "the distortion model of Vic-3D is not published",
                      "export the calibration in OpenCV's model");
  }
  return withoutDistortion(i, list);
}

struct LensModel {
  std::string_view name;
  Converter convert;
};
constexpr std::array kLensModels = {LensModel{"", withoutDistortion},
                                    LensModel{"NONE", withoutDistortion},
                                    LensModel{"NO_LENS_DISTORTION", withoutDistortion},
                                    LensModel{"OPENCV_DIS", openCvLens},
                                    LensModel{"OPENCV_LENS_DISTORTION", openCvLens},
                                    LensModel{"K1R1_K2R2_K3R3", firstSecondThird},
                                    LensModel{"K1R2_K2R4_K3R6", evenPowers},
                                    LensModel{"K1R3_K2R5_K3R7", oddPowers},
                                    LensModel{"VIC3D_DIS", vicLens},
                                    LensModel{"VIC3D_LENS_DISTORTION", vicLens}};

Result<Lens> readLens(const List& list, std::vector<std::string>& warnings) {
  Numbers number(list);
  const Intrinsics i{
      number("FX"),
      number("FY"),
      number("CX"),
      number("CY"),
      number("FS"),
      {number("K1"), number("K2"), number("K3"), number("K4"), number("K5"), number("K6")},
      {number("P1"), number("P2")},
      {number("S1"), number("S2"), number("S3"), number("S4")},
      {number("T1"), number("T2")}};
  if (number.error()) return *number.error();
  std::string key = "LENS_DISTORTION_MODEL";
  auto model = list.text(key);
  if (!model) model = list.text(key = "LD_MODEL");
  if (i.fs != 0.0) warnings.push_back(list.name + ": FS (skew) is left out, as DICe does");
  for (const LensModel& row : kLensModels) {
    if (row.name == model.value_or("")) return row.convert(i, list);
  }
  return list.wrong(key, "'" + *model + "' is not known");
}

/// Rows named "ROW 0" or, in older files, "LINE 0".
Result<Eigen::MatrixXd> readRows(const List& list, int columns) {
  Eigen::MatrixXd out(3, columns);
  for (int row = 0; row < 3; ++row) {
    const std::string number = std::to_string(row);
    auto text = list.text("ROW " + number);
    if (!text) text = list.text("LINE " + number);
    const auto values = parseNumbers(text.value_or(""));
    if (!values || values->size() != static_cast<std::size_t>(columns)) {
      return list.wrong("ROW " + number, "must have " + std::to_string(columns) + " numbers");
    }
    out.row(row) = Eigen::Map<const Eigen::RowVectorXd>(values->data(), columns);
  }
  return out;
}

Result<Mat3> readRotation(const List& list) {
  for (const char* key : {"rotation_3x3_matrix", "openCV_3x3_rotation_matrix"}) {
    const XmlElement* sublist = list.sublist(key);
    if (sublist == nullptr) continue;
    const List rows_list{*sublist, list.file, list.name + "." + key};
    const auto rows = readRows(rows_list, 3);
    if (!rows) return rows.error();
    const auto rotation = nearestRotation(*rows);
    if (!rotation) return list.wrong(key, "is not a rotation");
    return *rotation;
  }
  Numbers number(list);
  const double degree = std::numbers::pi / 180.0;
  const Mat3 rotation = (Eigen::AngleAxisd(degree * number("GAMMA"), Vec3::UnitZ()) *
                         Eigen::AngleAxisd(degree * number("BETA"), Vec3::UnitY()) *
                         Eigen::AngleAxisd(degree * number("ALPHA"), Vec3::UnitX()))
                            .toRotationMatrix();
  if (number.error()) return *number.error();
  return rotation;
}

Result<CalibratedCamera> readCamera(const List& list, const CalibrationImportOptions& options,
                                    std::vector<std::string>& warnings) {
  const auto lens = readLens(list, warnings);
  if (!lens) return lens.error();
  const auto rotation = readRotation(list);
  if (!rotation) return rotation.error();
  std::pair<int, int> size;
  if (options.size_px) {
    size = *options.size_px;
  } else {
    const auto values = parseNumbers(list.text("IMAGE_HEIGHT_WIDTH").value_or(""));
    const auto isSize = [](double v) { return v >= 1.0 && v <= 65536.0; };
    if (!values || values->size() != 2 || !isSize(values->front()) || !isSize(values->back())) {
      return list.wrong("IMAGE_HEIGHT_WIDTH", "must have two numbers", "--size says it");
    }
    size = {static_cast<int>(values->back()), static_cast<int>(values->front())};
  }
  const auto model = CameraModel::make(size.first, size.second, *lens);
  if (!model) return list.wrong(model.error().place, model.error().reason);
  Numbers number(list);
  CalibratedCamera camera{list.text("CAMERA_ID").value_or(""), *model};
  if (camera.name.empty()) camera.name = list.name;
  camera.camera_from_world.linear() = *rotation;
  camera.camera_from_world.translation() =
      options.unit_m * Vec3(number("TX"), number("TY"), number("TZ"));
  if (number.error()) return *number.error();
  return camera;
}

/// Older files give a pair's second camera relative to the first in a list of its own.
Result<void> readRelative(const List& root, const CalibrationImportOptions& options,
                          CameraCalibration& c) {
  const XmlElement* sublist = root.sublist("openCV_3x3_rot_trans_matrix");
  if (sublist != nullptr && c.cameras.size() == 2) {
    const List rows_list{*sublist, root.file, "openCV_3x3_rot_trans_matrix"};
    const auto rows = readRows(rows_list, 4);
    if (!rows) return rows.error();
    const auto rotation = nearestRotation(rows->leftCols<3>());
    if (!rotation) return rows_list.wrong("ROW 0", "the first three columns are not a rotation");
    Eigen::Isometry3d second_from_first = Eigen::Isometry3d::Identity();
    second_from_first.linear() = *rotation;
    second_from_first.translation() = options.unit_m * rows->col(3);
    c.cameras[1].camera_from_world = second_from_first * c.cameras[0].camera_from_world;
  } else if (root.text("extrinsics_relative_camera_to_camera").value_or("") == "true") {
    for (std::size_t i = 1; i < c.cameras.size(); ++i) {
      c.cameras[i].camera_from_world =
          c.cameras[i].camera_from_world * c.cameras[0].camera_from_world;
    }
  }
  return {};
}

}  // namespace

Result<CameraCalibration> calibrationFromDice(const XmlElement& element, const std::string& file,
                                              const CalibrationImportOptions& options) {
  const List root{element, file, ""};
  CameraCalibration c;
  c.source = "DICe";
  for (int i = 0; i < kMostCameras; ++i) {
    const std::string name = "CAMERA " + std::to_string(i);
    const XmlElement* sublist = root.sublist(name);
    if (sublist == nullptr) break;
    auto camera = readCamera(List{*sublist, file, name}, options, c.warnings);
    if (!camera) return camera.error();
    if (c.find(camera->name) != nullptr) camera->name = name;
    c.cameras.push_back(std::move(*camera));
  }
  if (c.cameras.empty())
    return badInput(file, "CAMERA 0", "is missing", "is it a camera system of DICe?");
  if (auto done = readRelative(root, options, c); !done) return done.error();
  const Eigen::Isometry3d old_from_world = c.cameras[0].camera_from_world.inverse();
  for (CalibratedCamera& camera : c.cameras) {
    camera.camera_from_world = camera.camera_from_world * old_from_world;
  }
  c.cameras[0].camera_from_world = Eigen::Isometry3d::Identity();
  warnOfUnit(c);
  return c;
}

}  // namespace tenter
