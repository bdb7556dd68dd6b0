// SPDX-License-Identifier: GPL-3.0-or-later
#include "rest_elements.h"

#include <cmath>
#include <numbers>

namespace tenter {
namespace {

double angleBetween(double angle, double rest) {
  return std::remainder(angle - rest, 2.0 * std::numbers::pi);
}

template <class T>
using V3 = Eigen::Matrix<T, 3, 1>;
template <class T>
using V2 = Eigen::Matrix<T, 2, 1>;

/// Area and gradients of the shape functions in the triangle's weft and warp axes.
template <class T>
struct RestShape {
  T area;
  std::array<V2<T>, 3> slope;
};

template <class T>
RestShape<T> restShape(const std::array<V3<T>, 3>& rest, const Mat2& frame) {
  const V3<T> a = rest[1] - rest[0], b = rest[2] - rest[0];
  const V3<T> cross = a.cross(b);
  const T twice_area = cross.norm();
  const Mat2 inverse = frame.inverse();
  V3<T> weft = a * T(inverse(0, 0)) + b * T(inverse(1, 0));
  weft /= weft.norm();
  const double turn = frame.determinant() < 0.0 ? -1.0 : 1.0;
  const V3<T> warp = cross.cross(weft) * (T(turn) / twice_area);
  const T determinant = T(turn) * twice_area;
  RestShape<T> shape;
  shape.area = twice_area * T(0.5);
  shape.slope[1] = V2<T>(b.dot(warp), -b.dot(weft)) / determinant;
  shape.slope[2] = V2<T>(-a.dot(warp), a.dot(weft)) / determinant;
  shape.slope[0] = -shape.slope[1] - shape.slope[2];
  return shape;
}

/// Stresses whose derivatives follow those of the strains by the law's tangent.
template <class T>
V3<T> stressOf(const StrainLaw& law, int element, const V3<T>& strain) {
  const LawValue value = law.evaluate(Vec3(strain[0].a, strain[1].a, strain[2].a), element);
  V3<T> stress;
  for (int i = 0; i < 3; ++i) {
    stress[i].a = value.stress[i];
    stress[i].v.setZero();
    for (int j = 0; j < 3; ++j) stress[i].v += value.tangent(i, j) * strain[j].v;
  }
  return stress;
}

template <class T>
T variable(double value, int index) {
  return T(value, index);
}

}  // namespace

EdgeGradient edgeGradient(const StrainLaw& law, int element, const std::array<Vec3, 2>& x,
                          const std::array<Vec3, 2>& rest) {
  const Vec3 d = x[1] - x[0], d0 = rest[1] - rest[0];
  const double length = d.norm(), rest_length = d0.norm();
  const Vec3 direction = d / length;
  const LawValue value = law.evaluate({length / rest_length - 1.0, 0.0, 0.0}, element);
  const double slope = -value.tangent(0, 0) * length / (rest_length * rest_length);
  return {value.stress[0] * direction, slope * direction * (d0 / rest_length).transpose()};
}

RawHingeGradient rawHingeGradient(const StrainLaw& law, int element, const Vec12& x,
                                  const Vec12& rest) {
  RawHingeGradient out;
  Vec12 by_pose, by_rest;
  const double angle = dihedralAngle(x, &by_pose), rest_angle = dihedralAngle(rest, &by_rest);
  const Vec3 r0 = rest.segment<3>(0), r1 = rest.segment<3>(3);
  const Vec3 e = r1 - r0;
  const Vec3 cross2 = e.cross(Vec3(rest.segment<3>(6) - r0));
  const Vec3 cross3 = Vec3(rest.segment<3>(9) - r0).cross(e);
  const double area = 0.5 * (cross2.norm() + cross3.norm());
  const double length2 = e.squaredNorm();
  const double weight = 3.0 * length2 / area;
  Vec12 by_area = Vec12::Zero();
  const auto addArea = [&](int a, int b, int c, const Vec3& normal) {
    const auto at = [&](int i) { return rest.segment<3>(3 * i); };
    by_area.segment<3>(3 * a) += 0.5 * normal.cross(Vec3(at(c) - at(b)));
    by_area.segment<3>(3 * b) += 0.5 * normal.cross(Vec3(at(a) - at(c)));
    by_area.segment<3>(3 * c) += 0.5 * normal.cross(Vec3(at(b) - at(a)));
  };
  addArea(0, 1, 2, cross2.normalized());
  addArea(1, 0, 3, cross3.normalized());
  Vec12 by_weight = -weight / area * by_area;
  by_weight.segment<3>(3) += (2.0 * weight / length2) * e;
  by_weight.segment<3>(0) -= (2.0 * weight / length2) * e;
  const LawValue value = law.evaluate({angleBetween(angle, rest_angle), 0.0, 0.0}, element);
  out.force = weight * value.stress[0] * by_pose;
  const Vec12 change = value.stress[0] * by_weight - weight * value.tangent(0, 0) * by_rest;
  out.block.noalias() = by_pose * change.transpose();
  return out;
}

WeightGradient weightGradient(double areal_density, const Vec3& gravity,
                              const std::array<Vec3, 3>& rest) {
  const Vec3 cross = Vec3(rest[1] - rest[0]).cross(Vec3(rest[2] - rest[0]));
  const Vec3 normal = cross.normalized();
  const Vec3 share = (-areal_density / 3.0) * gravity;
  WeightGradient out;
  out.force = 0.5 * cross.norm() * share;
  for (int i = 0; i < 3; ++i) {
    const Vec3 by_area = 0.5 * normal.cross(Vec3(rest[(i + 2) % 3] - rest[(i + 1) % 3]));
    out.blocks[static_cast<std::size_t>(i)] = share * by_area.transpose();
  }
  return out;
}

MembraneGradient membraneGradient(const StrainLaw& law, int element, MembraneElement measure,
                                  const Mat2& frame, const std::array<Vec3, 3>& x,
                                  const std::array<Vec3, 3>& rest) {
  using T = ceres::Jet<double, 9>;
  std::array<V3<T>, 3> r;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) r[i][k] = variable<T>(rest[i][k], 3 * i + k);
  const RestShape<T> shape = restShape(r, frame);
  V3<T> wu = V3<T>::Constant(T(0.0)), wv = wu;
  for (int i = 0; i < 3; ++i) {
    wu += x[i].cast<T>() * shape.slope[i][0];
    wv += x[i].cast<T>() * shape.slope[i][1];
  }
  const bool soft = measure == MembraneElement::kSoft;
  const T length_u = wu.norm(), length_v = wv.norm();
  V3<T> strain;
  strain << (soft ? length_u - T(1.0) : (wu.squaredNorm() - T(1.0)) * T(0.5)),
      (soft ? length_v - T(1.0) : (wv.squaredNorm() - T(1.0)) * T(0.5)), wu.dot(wv);
  const V3<T> stress = stressOf(law, element, strain);
  const V3<T> along_u = soft ? V3<T>(wu / length_u) : wu,
              along_v = soft ? V3<T>(wv / length_v) : wv;
  const V3<T> pu = (along_u * stress[0] + wv * stress[2]) * shape.area;
  const V3<T> pv = (along_v * stress[1] + wu * stress[2]) * shape.area;
  MembraneGradient out;
  for (int i = 0; i < 3; ++i) {
    const V3<T> force = pu * shape.slope[i][0] + pv * shape.slope[i][1];
    for (int k = 0; k < 3; ++k) {
      out.force[3 * i + k] = force[k].a;
      out.block.row(3 * i + k) = force[k].v.transpose();
    }
  }
  return out;
}

BentGradient bentGradient(const StrainLaw& law, int element, const BentTriangle& triangle) {
  using T = ceres::Jet<double, kBentSize>;
  std::array<V3<T>, 6> r;
  for (int i = 0; i < triangle.node_count; ++i)
    for (int k = 0; k < 3; ++k) r[i][k] = variable<T>(triangle.rest[i][k], 3 * i + k);
  const RestShape<T> shape = restShape<T>({r[0], r[1], r[2]}, triangle.frame);
  std::array<V3<T>, 3> unit;  // strains of a unit side angle
  std::array<Vec12, 3> by_pose;
  std::array<T, 3> rotation_share;
  V3<T> strain = V3<T>::Constant(T(0.0));
  for (int s = 0; s < 3; ++s) {
    const BentSide& side = triangle.sides[s];
    const V2<T> g = shape.slope[s];
    const T slope = g.norm();
    unit[s] << g[0] * g[0], g[1] * g[1], T(2.0) * g[0] * g[1];
    unit[s] *= T(2.0) / slope;
    rotation_share[s] = T(side.first ? 1.0 : -1.0) / (r[side.end] - r[side.begin]).norm();
    T bend = rotation_share[s] * variable<T>(side.rotation, 18 + s);
    if (side.hinge) {
      Vec12 x, rest, by_rest;
      for (int i = 0; i < 4; ++i) {
        x.segment<3>(3 * i) = triangle.x[side.hinge_nodes[i]];
        rest.segment<3>(3 * i) = triangle.rest[side.hinge_nodes[i]];
      }
      const double angle = dihedralAngle(x, &by_pose[s]);
      T change(angleBetween(angle, dihedralAngle(rest, &by_rest)));
      for (int i = 0; i < 4; ++i)
        for (int k = 0; k < 3; ++k) change.v[3 * side.hinge_nodes[i] + k] -= by_rest[3 * i + k];
      bend += T(0.5) * change;
    }
    strain += unit[s] * bend;
  }
  const V3<T> stress = stressOf(law, element, strain);
  BentGradient out;
  out.force.setZero();
  out.block.setZero();
  for (int s = 0; s < 3; ++s) {
    const BentSide& side = triangle.sides[s];
    const T moment = shape.area * unit[s].dot(stress);
    const T turn = rotation_share[s] * moment;
    out.force[18 + s] = turn.a;
    out.block.row(18 + s) = turn.v.transpose();
    if (!side.hinge) continue;
    for (int i = 0; i < 4; ++i) {
      for (int k = 0; k < 3; ++k) {
        const int row = 3 * side.hinge_nodes[i] + k;
        const double share = 0.5 * by_pose[s][3 * i + k];
        out.force[row] += share * moment.a;
        out.block.row(row) += share * moment.v.transpose();
      }
    }
  }
  return out;
}

}  // namespace tenter
