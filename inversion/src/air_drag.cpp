// SPDX-License-Identifier: GPL-3.0-or-later
#include "air_drag.h"

namespace tenter {

void AirDrag::setShape(const Points3& positions) {
  const auto count = static_cast<Eigen::Index>(triangles_.size());
  normals_.resize(3, count);
  areas_.resize(count);
  for (Eigen::Index t = 0; t < count; ++t) {
    const Triangle& ids = triangles_[static_cast<std::size_t>(t)];
    const Vec3 cross = Vec3(positions.col(ids[1]) - positions.col(ids[0]))
                           .cross(Vec3(positions.col(ids[2]) - positions.col(ids[0])));
    const double twice = cross.norm();
    areas_[t] = 0.5 * twice;
    normals_.col(t) = twice > 0.0 ? Vec3(cross / twice) : Vec3(Vec3::Zero());
  }
}

void AirDrag::add(const Points3& velocities, Points3& forces, std::vector<Mat3>* resistance) const {
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    const auto column = static_cast<Eigen::Index>(t);
    const Vec3 normal = normals_.col(column);
    const double half = 0.5 * air_.density_kg_per_m3 * areas_[column] / 3.0;
    const Mat3 along = normal * normal.transpose();
    for (const int v : triangles_[t]) {
      const Vec3 wind = air_.wind_m_per_s - velocities.col(v);
      const Vec3 through = along * wind, past = wind - through;
      const double speed_through = through.norm(), speed_past = past.norm();
      forces.col(v) += half * (air_.normal_drag * speed_through * through +
                               air_.tangential_drag * speed_past * past);
      if (resistance == nullptr) continue;
      Mat3 block = air_.normal_drag * 2.0 * speed_through * along;
      if (speed_past > 0.0)
        block += air_.tangential_drag *
                 (speed_past * (Mat3::Identity() - along) + past * past.transpose() / speed_past);
      (*resistance)[static_cast<std::size_t>(v)] += half * block;
    }
  }
}

}  // namespace tenter
