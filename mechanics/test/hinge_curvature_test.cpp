// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <functional>

#include "terms_support.h"

namespace tenter {
namespace {

using test_support::DenseHessian;

constexpr unsigned kSeed = 6;
/// Small against 1 / size, so that slopes of 0.01 leave 1e-4 between z'' and the true curvature.
constexpr double kCurvature_per_m = 0.4;
/// Ten times what those slopes leave.
constexpr double kEnergyTolerance = 1e-3;
const Vec2 kSize(0.05, 0.04);

struct Shape {
  const char* name;
  Mat2 second;  ///< -d2z, what the curvature must come out as.
};

std::vector<Shape> shapes() {
  Mat2 weft, warp, twist, mixed;
  weft << kCurvature_per_m, 0, 0, 0;
  warp << 0, 0, 0, kCurvature_per_m;
  twist << 0, kCurvature_per_m, kCurvature_per_m, 0;
  mixed << kCurvature_per_m, 0.3 * kCurvature_per_m, 0.3 * kCurvature_per_m,
      -0.6 * kCurvature_per_m;
  return {{"weft", weft}, {"warp", warp}, {"twist", twist}, {"mixed", mixed}};
}

struct Layout {
  const char* name;
  std::function<SheetMesh()> make;
  EdgeRotations rotations;
};

std::vector<Layout> layouts() {
  const auto uniform = [] { return gridSheet(kSize, 9, 7, DiagonalPattern::kUniform); };
  const auto alternating = [] { return gridSheet(kSize, 9, 7, DiagonalPattern::kAlternating); };
  const auto unstructured = [] { return unstructuredSheet(kSize, 0.006, kSeed); };
  const auto graded = [] {
    return gridSheet({linesThrough(0.0, kSize[0], 9, {0.0171}),
                      linesThrough(0.0, kSize[1], 7, {0.03}), DiagonalPattern::kUniform});
  };
  return {{"uniform", uniform, EdgeRotations::kAutomatic},
          {"uniform boundary-only", uniform, EdgeRotations::kBoundaryOnly},
          {"uniform all", uniform, EdgeRotations::kAll},
          {"alternating", alternating, EdgeRotations::kAutomatic},
          {"graded", graded, EdgeRotations::kAutomatic},
          {"unstructured", unstructured, EdgeRotations::kAutomatic}};
}

/// B grows with curvature, differently along weft, warp and twist, within the curvatures that the
/// test reaches.
std::array<StiffnessCurve, 3> rigidities() {
  const auto curve = [](double at_rest, double bent) {
    return StiffnessCurve::fromKnots({0.0, 0.3, 1.0}, {at_rest, bent, bent}, {0.0, 0.0, 0.0}, true)
        .value();
  };
  return {curve(3e-5, 5e-5), curve(1e-5, 1.5e-5), curve(4e-6, 7e-6)};
}

double height(const Shape& shape, const Vec2& uv) {
  const Vec2 d = uv - 0.5 * kSize;
  return -0.5 * d.dot(shape.second * d);
}

/// Exact coordinates of a boundary rotation: length times minus the outward slope of z over the
/// flat triangle's.
double boundaryRotation(const SheetMesh& sheet, const Shape& shape, int edge) {
  const MeshEdge& e = sheet.topology.edges[edge];
  const Vec2 a = sheet.rest.uv.col(e.vertices[0]), b = sheet.rest.uv.col(e.vertices[1]);
  const Vec2 apex = sheet.rest.uv.col(e.opposite[0]);
  const Vec2 along = (b - a).normalized(), outward(along[1], -along[0]);
  const Vec2 slope = -shape.second * (0.5 * (a + b) - 0.5 * kSize);
  const double distance = outward.dot(a - apex);
  const double foot = along.dot(apex - a) / (b - a).norm();
  const double on_edge = (1.0 - foot) * height(shape, a) + foot * height(shape, b);
  const double flat = (on_edge - height(shape, apex)) / distance;
  return -(slope.dot(outward) - flat) * (b - a).norm();
}

class PatchTest : public testing::TestWithParam<std::tuple<Layout, Shape>> {
 protected:
  PatchTest()
      : sheet(layout.make()),
        hinge(makeHingeTerm(sheet, std::make_shared<DiagonalLaw>(rigidities()), {},
                            layout.rotations, 3 * sheet.nodeCount())) {
    exact = test_support::restCoordinates(sheet, 3 * sheet.nodeCount() + hinge.rotation_count);
    // A rotation counts from its triangle's plane, so holding the border's slope takes all of the
    // border's triangles.
    std::vector<bool> held(sheet.nodeCount(), false);
    for (const MeshEdge& e : sheet.topology.edges) {
      if (e.triangles[1] >= 0) continue;
      for (const int node : {e.vertices[0], e.vertices[1], e.opposite[0]}) held[node] = true;
    }
    for (int i = 0; i < sheet.nodeCount(); ++i) {
      exact[3 * i + 2] = height(shape, sheet.rest.uv.col(i));
      if (!held[i]) unknowns.push_back(3 * i + 2);
    }
    for (int r = 0; r < hinge.rotation_count; ++r) {
      const int coordinate = 3 * sheet.nodeCount() + r;
      const int edge = hinge.rotation_edge[r];
      if (sheet.topology.edges[edge].triangles[1] < 0) {
        exact[coordinate] = boundaryRotation(sheet, shape, edge);
      } else {
        unknowns.push_back(coordinate);
      }
    }
  }

  /// Newton on the inner heights and rotations, the border's triangles and rotations held.
  Eigen::VectorXd relax(Eigen::VectorXd q) const {
    const auto n = static_cast<Eigen::Index>(unknowns.size());
    for (int iteration = 0; iteration < 20; ++iteration) {
      DenseHessian h(*hinge.term, static_cast<int>(q.size()));
      hinge.term->addHessian(
          q, iteration < 4 ? Projection::kPositiveSemiDefinite : Projection::kNone, h);
      Eigen::VectorXd g = Eigen::VectorXd::Zero(q.size());
      hinge.term->addGradient(q, g);
      const Eigen::MatrixXd reduced = h.matrix(unknowns, unknowns);
      const Eigen::VectorXd step = reduced.ldlt().solve(Eigen::VectorXd(g(unknowns)));
      for (Eigen::Index i = 0; i < n; ++i) q[unknowns[i]] -= step[i];
      if (step.cwiseAbs().maxCoeff() < 1e-14) break;
    }
    return q;
  }

  const Layout layout = std::get<0>(GetParam());
  const Shape shape = std::get<1>(GetParam());
  SheetMesh sheet;
  HingeTerm hinge;
  Eigen::VectorXd exact;
  std::vector<int> unknowns;
};

TEST_P(PatchTest, ConstantCurvatureCostsWhatTheFileSays) {
  test_support::DeformedStates noise(sheet, static_cast<int>(exact.size()), kSeed);
  Eigen::VectorXd start = exact;
  for (const int i : unknowns) start[i] += 1e-5 * noise.uniform();
  const Eigen::VectorXd q = relax(start);

  const auto curves = rigidities();
  const double density = curves[0].evaluate(shape.second(0, 0)).energy +
                         curves[1].evaluate(shape.second(1, 1)).energy +
                         curves[2].evaluate(2.0 * shape.second(0, 1)).energy;
  ASSERT_GT(density, 0.0);
  const double error = hinge.term->energy(q) / (density * sheet.area()) - 1.0;
  EXPECT_NEAR(error, 0.0, kEnergyTolerance);

  Eigen::Matrix3Xd strains;
  hinge.term->strains(q, strains);
  const Vec3 expected(shape.second(0, 0), shape.second(1, 1), 2.0 * shape.second(0, 1));
  const double worst = (strains.colwise() - expected).cwiseAbs().maxCoeff() / kCurvature_per_m;
  EXPECT_LE(worst, kEnergyTolerance);
  double height_error = 0.0;
  for (int i = 0; i < sheet.nodeCount(); ++i) {
    height_error = std::max(height_error, std::abs(q[3 * i + 2] - exact[3 * i + 2]));
  }
  EXPECT_LE(height_error, 1e-3 * exact.cwiseAbs().maxCoeff());
  std::printf("  %-22s %-6s energy %+.1e curvature %.1e\n", layout.name, shape.name, error, worst);
}

INSTANTIATE_TEST_SUITE_P(
    Sheets, PatchTest, testing::Combine(testing::ValuesIn(layouts()), testing::ValuesIn(shapes())),
    [](const auto& test) {
      std::string name = std::string(std::get<0>(test.param).name) + std::get<1>(test.param).name;
      std::erase_if(name, [](char c) { return c == '-' || c == ' '; });
      return name;
    });

TEST(HingeTermTest, RotationsOnlyWhereHalfAnglesFail) {
  const auto law = std::make_shared<DiagonalLaw>(rigidities());
  const auto count = [&](const SheetMesh& sheet, EdgeRotations rotations) {
    return makeHingeTerm(sheet, law, {}, rotations, 0).rotation_count;
  };
  const SheetMesh uniform = gridSheet(kSize, 9, 7, DiagonalPattern::kUniform);
  const int boundary = 2 * (8 + 6), edges = static_cast<int>(uniform.topology.edges.size());
  EXPECT_EQ(count(uniform, EdgeRotations::kAutomatic), boundary);
  EXPECT_EQ(count(uniform, EdgeRotations::kAll), edges);
  const SheetMesh alternating = gridSheet(kSize, 9, 7, DiagonalPattern::kAlternating);
  EXPECT_EQ(count(alternating, EdgeRotations::kAutomatic), edges - 8 * 6);  // All but diagonals.
  const SheetMesh graded =
      gridSheet({linesThrough(0.0, kSize[0], 9, {0.0171}), linesThrough(0.0, kSize[1], 7, {}),
                 DiagonalPattern::kUniform});
  EXPECT_EQ(count(graded, EdgeRotations::kAutomatic), boundary + 6);  // The line on the stop.
}

/// A flat clip up to the third line, then constant curvature: the half-width cell at the clamp line
/// sees it too.
TEST(HingeTermTest, ClampLineTakesTheWholeAngle) {
  const SheetMesh sheet = gridSheet(kSize, 9, 7, DiagonalPattern::kUniform);
  const double clamp = sheet.grid->u_lines[2];
  std::vector<bool> rigid(sheet.triangleCount());
  for (int t = 0; t < sheet.triangleCount(); ++t) {
    double reach = 0.0;
    for (const int node : sheet.rest.triangles[t]) reach = std::max(reach, sheet.rest.uv(0, node));
    rigid[t] = reach <= clamp + 1e-9;
  }
  const int first = 3 * sheet.nodeCount();
  const HingeTerm hinge = makeHingeTerm(sheet, std::make_shared<DiagonalLaw>(rigidities()), rigid,
                                        EdgeRotations::kAutomatic, first);
  Eigen::VectorXd q = test_support::restCoordinates(sheet, first + hinge.rotation_count);
  const auto sag = [&](double u) {
    return u > clamp ? -0.5 * kCurvature_per_m * (u - clamp) * (u - clamp) : 0.0;
  };
  for (int i = 0; i < sheet.nodeCount(); ++i) q[3 * i + 2] = sag(sheet.rest.uv(0, i));
  for (int r = 0; r < hinge.rotation_count; ++r) {
    const MeshEdge& e = sheet.topology.edges[hinge.rotation_edge[r]];
    const double u = sheet.rest.uv(0, e.vertices[0]);
    const bool tip = u == kSize[0] && sheet.rest.uv(0, e.vertices[1]) == u;
    const double h = sheet.grid->u_lines[1];
    // Over half a cell the tangent turns by kappa h / 2; edges along u have no slope across.
    if (tip) q[first + r] = 0.5 * kCurvature_per_m * h * sheet.grid->v_lines[1];
  }
  Eigen::Matrix3Xd strains;
  hinge.term->strains(q, strains);
  ASSERT_EQ(strains.cols(), sheet.triangleCount() * 6 / 8);
  for (int k = 0; k < strains.cols(); ++k) {
    EXPECT_NEAR(strains(0, k), kCurvature_per_m, kEnergyTolerance * kCurvature_per_m) << k;
  }
}

TEST(HingeTermTest, FoldsUnwrapAgainstTheRestAngle) {
  // Two triangles folded past pi - 0.1 at rest, then past pi: the strain stays continuous.
  TriangleMesh mesh;
  mesh.positions.resize(3, 4);
  const auto fold = [](double angle) { return Vec3(0.5, std::cos(angle), -std::sin(angle)); };
  mesh.positions << 0, 1, 0.5, 0, 0, 0, -1, 0, 0, 0, 0, 0;
  mesh.positions.col(3) = fold(3.1);
  mesh.uv.resize(2, 4);
  mesh.uv << 0, 1, 0.5, 0.5, 0, 0, -1, 1;
  mesh.triangles = {{1, 0, 2}, {0, 1, 3}};
  const SheetMesh sheet = sheetFromMesh(mesh, false).value();
  const auto law = std::make_shared<DiagonalLaw>(rigidities());
  const HingeTerm hinge = makeHingeTerm(sheet, law, {}, EdgeRotations::kAll, 12);
  const auto raw = makeRawHingeTerm(sheet, law);
  for (const double more : {0.0, 0.04, 0.08}) {  // pi is passed at 0.0416.
    Eigen::VectorXd q = test_support::restCoordinates(sheet, 12 + hinge.rotation_count);
    q.segment<3>(9) = fold(3.1 + more);
    Eigen::Matrix3Xd strain, angle;
    hinge.term->strains(q, strain);
    raw->strains(q, angle);
    EXPECT_NEAR(std::abs(angle(0, 0)), more, 1e-12);
    EXPECT_NEAR(strain.cwiseAbs().maxCoeff(), more, 1e-12);  // l / (2 A) is 1 1/m.
  }
}

}  // namespace
}  // namespace tenter
