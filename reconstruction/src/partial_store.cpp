// SPDX-License-Identifier: GPL-3.0-or-later
#include "partial_store.h"

#include <cstring>
#include <nlohmann/json.hpp>

#include "tenter/core/files.h"

namespace tenter {

namespace fs = std::filesystem;
using Json = nlohmann::json;

namespace {

constexpr const char* kSuffix = ".frame";
/// Numbers of a covariance that are kept: it is symmetric.
constexpr std::size_t kCovarianceTerms = 6;

template <class Value>
Json blob(const std::vector<Value>& values) {
  std::vector<std::uint8_t> bytes(values.size() * sizeof(Value));
  if (!bytes.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  return Json::binary(std::move(bytes));
}

/// Values of a blob; throws if there are not exactly `count`.
template <class Value>
std::vector<Value> valuesOf(const Json& json, std::size_t count) {
  const auto& bytes = json.get_binary();
  if (bytes.size() != count * sizeof(Value)) throw std::out_of_range("blob");
  std::vector<Value> values(count);
  if (count > 0) std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

std::vector<double> numbersOf(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  return {matrix.reshaped().begin(), matrix.reshaped().end()};
}

Json clipJson(const ClipReading& clip) {
  std::vector<double> outline;
  for (const Vec2& corner : clip.outline_uv_m)
    outline.insert(outline.end(), {corner.x(), corner.y()});
  return {{"clip", clip.clip},
          {"pose", numbersOf(clip.rig_from_clip.matrix())},
          {"vertices", clip.clamped_vertices},
          {"outline", outline}};
}

ClipReading clipOf(const Json& json) {
  ClipReading clip;
  clip.clip = json.at("clip").get<std::string>();
  const auto pose = json.at("pose").get<std::vector<double>>();
  if (pose.size() != 16) throw std::out_of_range("pose");
  clip.rig_from_clip.matrix() = Eigen::Map<const Eigen::Matrix4d>(pose.data());
  clip.clamped_vertices = json.at("vertices").get<std::vector<int>>();
  const auto outline = json.at("outline").get<std::vector<double>>();
  for (std::size_t i = 0; i + 1 < outline.size(); i += 2) {
    clip.outline_uv_m.emplace_back(outline[i], outline[i + 1]);
  }
  return clip;
}

Json cordJson(const CordReading& cord) {
  return {{"cord", cord.cord},
          {"clip", cord.clip},
          {"attachment", numbersOf(cord.attachment_m)},
          {"direction", numbersOf(cord.direction)},
          {"tension", cord.tension_N},
          {"sigma", cord.tension_sigma_N}};
}

Vec3 vectorOf(const Json& json) {
  const auto numbers = json.get<std::vector<double>>();
  return {numbers.at(0), numbers.at(1), numbers.at(2)};
}

CordReading cordOf(const Json& json) {
  return {json.at("cord").get<std::string>(), json.at("clip").get<std::string>(),
          vectorOf(json.at("attachment")),    vectorOf(json.at("direction")),
          json.at("tension").get<double>(),   json.at("sigma").get<double>()};
}

Json clothJson(const ClothFrame& cloth) {
  std::vector<double> covariances;
  for (const Mat3& c : cloth.covariances_m2) {
    covariances.insert(covariances.end(), {c(0, 0), c(0, 1), c(0, 2), c(1, 1), c(1, 2), c(2, 2)});
  }
  std::vector<std::uint8_t> states;
  for (const PointState state : cloth.states) states.push_back(static_cast<std::uint8_t>(state));
  return {{"positions", blob(numbersOf(cloth.positions_m))},
          {"covariances", blob(covariances)},
          {"states", blob(states)},
          {"views", blob(cloth.views)},
          {"zncc", blob(cloth.zncc)},
          {"residuals", blob(cloth.residual_px)},
          {"filled", cloth.filled_m},
          {"warnings", cloth.warnings}};
}

ClothFrame clothOf(const Json& json, std::size_t count) {
  ClothFrame cloth;
  const auto positions = valuesOf<double>(json.at("positions"), 3 * count);
  cloth.positions_m =
      Eigen::Map<const Points3>(positions.data(), 3, static_cast<Eigen::Index>(count));
  const auto c = valuesOf<double>(json.at("covariances"), kCovarianceTerms * count);
  for (std::size_t i = 0; i < c.size(); i += kCovarianceTerms) {
    Mat3 m;
    m << c[i], c[i + 1], c[i + 2], c[i + 1], c[i + 3], c[i + 4], c[i + 2], c[i + 4], c[i + 5];
    cloth.covariances_m2.push_back(m);
  }
  for (const std::uint8_t state : valuesOf<std::uint8_t>(json.at("states"), count)) {
    if (state >= kPointStates) throw std::out_of_range("state");
    cloth.states.push_back(static_cast<PointState>(state));
  }
  cloth.views = valuesOf<std::uint8_t>(json.at("views"), count);
  cloth.zncc = valuesOf<float>(json.at("zncc"), count);
  cloth.residual_px = valuesOf<float>(json.at("residuals"), count);
  cloth.filled_m = json.at("filled").get<double>();
  cloth.warnings = json.at("warnings").get<std::vector<std::string>>();
  return cloth;
}

}  // namespace

PartialStore::PartialStore(fs::path folder, const std::string& identity)
    : folder_(std::move(folder)), identity_(sha256(identity)) {}

fs::path PartialStore::fileOf(std::int64_t number) const {
  return folder_ / (std::to_string(number) + kSuffix);
}

std::optional<FinishedFrame> PartialStore::load(std::int64_t number, std::size_t vertices) const {
  if (folder_.empty()) return std::nullopt;
  const auto bytes = readFile(fileOf(number));
  if (!bytes) return std::nullopt;
  try {
    const Json json = Json::from_cbor(*bytes);
    if (json.at("identity").get<std::string>() != identity_) return std::nullopt;
    FinishedFrame finished;
    finished.cloth = clothOf(json.at("cloth"), vertices);
    finished.frame.time_ns = json.at("time_ns").get<std::int64_t>();
    finished.frame.branch = static_cast<Branch>(json.at("branch").get<int>());
    for (const Json& clip : json.at("clips")) finished.frame.clips.push_back(clipOf(clip));
    for (const Json& cord : json.at("cords")) finished.frame.cords.push_back(cordOf(cord));
    finished.clip_position_sigma_m = json.at("clip_position_sigma").get<double>();
    finished.clip_rotation_sigma_rad = json.at("clip_rotation_sigma").get<double>();
    finished.seconds = json.at("seconds").get<double>();
    return finished;
  } catch (const std::exception&) {
    // Damaged: the frame is done again.
    return std::nullopt;
  }
}

Result<void> PartialStore::save(std::int64_t number, const FinishedFrame& finished) const {
  if (folder_.empty()) return {};
  std::error_code failed;
  fs::create_directories(folder_, failed);
  if (failed) return badInput(folder_.string(), "", "cannot be made: " + failed.message());
  Json json = {{"identity", identity_},
               {"time_ns", finished.frame.time_ns},
               {"branch", static_cast<int>(finished.frame.branch)},
               {"cloth", clothJson(finished.cloth)},
               {"clip_position_sigma", finished.clip_position_sigma_m},
               {"clip_rotation_sigma", finished.clip_rotation_sigma_rad},
               {"seconds", finished.seconds}};
  json["clips"] = Json::array();
  json["cords"] = Json::array();
  for (const ClipReading& clip : finished.frame.clips) json["clips"].push_back(clipJson(clip));
  for (const CordReading& cord : finished.frame.cords) json["cords"].push_back(cordJson(cord));
  const std::vector<std::uint8_t> bytes = Json::to_cbor(json);
  return writeFileAtomically(fileOf(number),
                             {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

void PartialStore::clear() const {
  if (folder_.empty()) return;
  std::error_code failed;
  for (const auto& entry : fs::directory_iterator(folder_, failed)) {
    if (entry.path().extension() == kSuffix) fs::remove(entry.path(), failed);
  }
  fs::remove(folder_, failed);
}

}  // namespace tenter
