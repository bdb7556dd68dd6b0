// SPDX-License-Identifier: GPL-3.0-or-later
#include "analytic_obstacles.h"

#include <array>
#include <charconv>
#include <cmath>
#include <vector>

namespace tenter {
namespace {

class Sphere final : public Obstacle {
 public:
  Sphere(const Vec3& centre, double radius) : centre_(centre), radius_(radius) {}
  Nearest nearest(const Vec3& place) const override {
    const Vec3 d = place - centre_;
    const double distance = d.norm();
    const Vec3 normal = distance > 0.0 ? Vec3(d / distance) : Vec3(Vec3::UnitZ());
    return {distance - radius_, centre_ + radius_ * normal, normal};
  }

 private:
  Vec3 centre_;
  double radius_;
};

class HalfSpace final : public Obstacle {
 public:
  HalfSpace(const Vec3& point, const Vec3& normal) : point_(point), normal_(normal) {}
  Nearest nearest(const Vec3& place) const override {
    const double distance = normal_.dot(place - point_);
    return {distance, place - distance * normal_, normal_};
  }

 private:
  Vec3 point_, normal_;
};

/// Endless about its axis: radius(t) = ra + t slope at the length t along it.
class Cone final : public Obstacle {
 public:
  Cone(const Vec3& begin, const Vec3& end, double radius_begin, double radius_end)
      : begin_(begin), axis_((end - begin).normalized()), radius_(radius_begin) {
    const double slope = (radius_end - radius_begin) / (end - begin).norm();
    cosine_ = 1.0 / std::sqrt(1.0 + slope * slope);
    sine_ = slope * cosine_;
  }
  Nearest nearest(const Vec3& place) const override {
    const Vec3 d = place - begin_;
    const double along = d.dot(axis_);
    const Vec3 across = d - along * axis_;
    const double from_axis = across.norm();
    const Vec3 out = from_axis > 0.0 ? Vec3(across / from_axis) : axis_.unitOrthogonal();
    const Vec3 normal = cosine_ * out - sine_ * axis_;
    const double distance = (from_axis - radius_) * cosine_ - along * sine_;
    return {distance, place - distance * normal, normal};
  }

 private:
  Vec3 begin_, axis_;
  double radius_, cosine_, sine_;
};

Result<std::vector<double>> numbersOf(const std::string& description, std::size_t colon,
                                      std::size_t count) {
  std::vector<double> numbers;
  const char* at = description.data() + colon + 1;
  const char* const end = description.data() + description.size();
  for (;;) {
    double value = 0.0;
    const auto [next, code] = std::from_chars(at, end, value);
    if (code != std::errc() || !std::isfinite(value) || (next != end && *next != ',')) {
      return usageError("--obstacle: cannot read '" + description + "'",
                        "numbers with commas between");
    }
    numbers.push_back(value);
    if (next == end) break;
    at = next + 1;
  }
  if (numbers.size() == count) return numbers;
  return usageError("--obstacle: '" + description + "' needs " + std::to_string(count) +
                    " numbers, not " + std::to_string(numbers.size()));
}

Result<std::unique_ptr<Obstacle>> impossible(const std::string& description,
                                             const std::string& why) {
  return usageError("--obstacle: '" + description + "': " + why);
}

}  // namespace

Result<std::unique_ptr<Obstacle>> makeAnalyticObstacle(const std::string& description) {
  struct Kind {
    const char* name;
    std::size_t numbers;
  };
  constexpr std::array kKinds{Kind{"sphere", 4}, Kind{"plane", 6}, Kind{"cylinder", 7},
                              Kind{"cone", 8}};
  const std::size_t colon = description.find(':');
  const std::string kind = description.substr(0, colon);
  std::size_t index = 0;
  while (index < kKinds.size() && (colon == std::string::npos || kind != kKinds[index].name))
    ++index;
  if (index == kKinds.size()) return std::unique_ptr<Obstacle>();
  const auto read = numbersOf(description, colon, kKinds[index].numbers);
  if (!read) return read.error();
  const std::vector<double>& v = *read;
  const Vec3 a(v[0], v[1], v[2]);
  if (kind == "sphere") {
    if (!(v[3] > 0.0)) return impossible(description, "the radius must be positive");
    return std::unique_ptr<Obstacle>(std::make_unique<Sphere>(a, v[3]));
  }
  const Vec3 b(v[3], v[4], v[5]);
  if (kind == "plane") {
    if (!(b.norm() > 0.0)) return impossible(description, "the normal has no length");
    return std::unique_ptr<Obstacle>(std::make_unique<HalfSpace>(a, b.normalized()));
  }
  if (!((b - a).norm() > 0.0)) return impossible(description, "the axis has no length");
  const double ra = v[6], rb = v.back();
  if (ra < 0.0 || rb < 0.0 || !(ra + rb > 0.0))
    return impossible(description, "the radius must be positive");
  return std::unique_ptr<Obstacle>(std::make_unique<Cone>(a, b, ra, rb));
}

}  // namespace tenter
