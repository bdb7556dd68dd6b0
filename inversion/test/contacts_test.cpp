// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/inversion/contacts.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tenter/inversion/sliding_proof.h"

namespace tenter {
namespace {

/// A box of half widths (1, 2, 3), triangles turning outwards.
TriangleMesh box() {
  TriangleMesh mesh;
  mesh.positions.resize(3, 8);
  for (int v = 0; v < 8; ++v)
    mesh.positions.col(v) = Vec3(v & 1 ? 1 : -1, v & 2 ? 2 : -2, v & 4 ? 3 : -3);
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

TEST(ObstacleTest, MeshDistanceIsSignedOnFacesEdgesAndCorners) {
  const auto obstacle = makeMeshObstacle(box());
  ASSERT_TRUE(obstacle.ok()) << obstacle.error().message();
  const auto at = [&](double x, double y, double z) { return (*obstacle)->nearest(Vec3(x, y, z)); };
  EXPECT_NEAR(at(0.2, 0.1, 3.5).distance_m, 0.5, 1e-12);
  EXPECT_NEAR(at(0.2, 0.1, 2.5).distance_m, -0.5, 1e-12);
  EXPECT_NEAR(at(1.3, 2.4, 0.0).distance_m, 0.5, 1e-12);
  EXPECT_NEAR(at(2.0, 4.0, 5.0).distance_m, 3.0, 1e-12);
  EXPECT_NEAR((at(0.2, 0.1, 3.5).normal - Vec3::UnitZ()).norm(), 0.0, 1e-12);
}

TEST(ObstacleTest, AnalyticBodiesKnowDistanceAndNormal) {
  const auto cone = makeObstacle("cone:0,0,0,0,0,-1,0.5,1.5");
  ASSERT_TRUE(cone.ok()) << cone.error().message();
  const Obstacle::Nearest n = (*cone)->nearest(Vec3(1.0, 0.0, 0.0));
  EXPECT_NEAR(n.distance_m, 0.5 * std::sqrt(0.5), 1e-12);
  EXPECT_NEAR((n.normal - Vec3(std::sqrt(0.5), 0.0, std::sqrt(0.5))).norm(), 0.0, 1e-12);
  EXPECT_NEAR((*makeObstacle("sphere:1,0,0,2"))->nearest(Vec3(4, 0, 0)).distance_m, 1.0, 1e-12);
  EXPECT_NEAR((*makeObstacle("plane:0,0,1,0,0,5"))->nearest(Vec3(9, 9, 3)).distance_m, 2.0, 1e-12);
  EXPECT_NEAR((*makeObstacle("cylinder:0,0,0,0,0,1,2"))->nearest(Vec3(3, 0, 7)).distance_m, 1.0,
              1e-12);
}

TEST(ObstacleTest, NonsenseIsRefusedByName) {
  for (const char* bad :
       {"sphere:0,0,0", "sphere:0,0,0,-1", "sphere:0,0,0,nan", "plane:0,0,0,0,0,0",
        "cylinder:0,0,0,0,0,0,1", "cone:0,0,0,0,0,1,x,1", "sphere:0,0,0,1,"}) {
    EXPECT_FALSE(makeObstacle(bad).ok()) << bad;
  }
  TriangleMesh inwards = box();
  for (Triangle& t : inwards.triangles) std::swap(t[1], t[2]);
  const auto refused = makeMeshObstacle(inwards);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().reason.find("inwards"), std::string::npos);
}

TEST(ContactsTest, VerticesOnTheBodyTouchAndDeepOnesAreRefused) {
  TriangleMesh mesh;
  mesh.positions.resize(3, 4);
  mesh.positions << 0, 1, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0.5;
  mesh.triangles = {{0, 1, 2}, {1, 3, 2}};
  std::vector<std::unique_ptr<Obstacle>> floor;
  floor.push_back(makeObstacle("plane:0,0,0,0,0,1").value());
  const auto contacts = findContacts(mesh, floor, {1}, {0.3, 0.0});
  ASSERT_TRUE(contacts.ok());
  ASSERT_EQ(contacts->size(), 2u);
  EXPECT_EQ((*contacts)[1].vertex, 2);
  EXPECT_EQ((*contacts)[1].friction, 0.3);
  mesh.positions(2, 2) = -0.1;
  const auto refused = findContacts(mesh, floor, {1}, {0.3, 0.0});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().place, "vertex 2");
  EXPECT_NE(refused.error().reason.find("100 mm"), std::string::npos) << refused.error().reason;
}

std::vector<Contact> slope(double tangent, double friction) {
  Contact c;
  c.normal = Vec3(-tangent, 0.0, 1.0).normalized();
  c.friction = friction;
  return {c, c, c};
}

TEST(SlidingProofTest, ASlopeSticksUpToItsFriction) {
  EXPECT_FALSE(findSlidingProof(slope(0.4 * (1 - 1e-9), 0.4), kDefaultGravity));
  const auto proof = findSlidingProof(slope(0.5, 0.4), kDefaultGravity);
  ASSERT_TRUE(proof);
  EXPECT_TRUE(provesSliding(proof->direction, slope(0.5, 0.4), kDefaultGravity));
  EXPECT_NEAR(proof->friction_factor_min, 1.25, 1e-4);
}

TEST(SlidingProofTest, AValleyHoldsWithoutFriction) {
  std::vector<Contact> valley = slope(0.5, 0.0);
  EXPECT_TRUE(findSlidingProof(valley, kDefaultGravity));
  valley[0].normal[0] = -valley[0].normal[0];
  EXPECT_FALSE(findSlidingProof(valley, kDefaultGravity));
}

}  // namespace
}  // namespace tenter
