#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>

#include "master_station/display/camera.h"
#include "master_station/display/picture.h"
#include "master_station/display/solid.h"

namespace farfeel::master_station {
namespace {

geometry::TriangleMesh cuboid(const glm::dvec3& half) {
  geometry::TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.positions_O.push_back({(i & 1 ? 1 : -1) * half.x, (i & 2 ? 1 : -1) * half.y, (i & 4 ? 1 : -1) * half.z});
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

glm::ivec3 pixel(const Image& image, int x, int y) {
  const auto at =
      (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x)) * 4;
  return {image.rgba[at], image.rgba[at + 1], image.rgba[at + 2]};
}

// Where a camera sees a world point, in pixels from the top left.
glm::dvec2 seen_at(const Camera& camera, const glm::dvec3& p_W, int width, int height) {
  const glm::dvec3 forward = glm::normalize(camera.target_W - camera.eye_W);
  const glm::dvec3 right = glm::normalize(glm::cross(forward, glm::dvec3(0, 0, 1)));
  const glm::dvec3 up = glm::cross(right, forward);
  const glm::dvec3 d = p_W - camera.eye_W;
  const double scale = height / (2 * std::tan(camera.field_of_view_rad / 2) * glm::dot(d, forward));
  return {width / 2.0 + scale * glm::dot(d, right), height / 2.0 - scale * glm::dot(d, up)};
}

TEST(Camera, SeesTheWholeBoxAndFillsThePicture) {
  for (const glm::dvec3 size : {glm::dvec3(1, 1, 1), glm::dvec3(0.2, 0.025, 0.006), glm::dvec3(1, 5, 9)}) {
    geometry::Box box;
    box.include(glm::dvec3(7, -3, 2));
    box.include(glm::dvec3(7, -3, 2) + size);
    const Camera camera = camera_for(box, 1.6);
    double nearest_edge = 1e9;
    for (int corner = 0; corner < 8; ++corner) {
      const glm::dvec3 p(corner & 1 ? box.low.x : box.high.x, corner & 2 ? box.low.y : box.high.y,
                         corner & 4 ? box.low.z : box.high.z);
      const glm::dvec2 at = seen_at(camera, p, 1600, 1000);
      nearest_edge = std::min({nearest_edge, at.x, at.y, 1600 - at.x, 1000 - at.y});
    }
    EXPECT_GT(nearest_edge, 0);
    EXPECT_LT(nearest_edge, 160);
  }
}

TEST(Solid, RoundsRidgesAndKeepsEdges) {
  const Solid cube = solid_of(cuboid({1, 1, 1}), {}, glm::dvec3(0));
  ASSERT_EQ(cube.size(), 36u);
  for (std::size_t i = 0; i < cube.size(); i += 3) {
    const glm::vec3 face =
        glm::normalize(glm::cross(cube[i + 1].position - cube[i].position, cube[i + 2].position - cube[i].position));
    for (std::size_t corner = i; corner < i + 3; ++corner) EXPECT_LT(glm::length(cube[corner].normal_W - face), 1e-5F);
  }
  Solid ball;
  append_ball(ball, {1, 2, 3}, 0.5);
  for (const Corner& corner : ball) EXPECT_NEAR(glm::length(corner.position - glm::vec3(1, 2, 3)), 0.5, 1e-5);
}

class PictureTest : public testing::Test {
 protected:
  void SetUp() override {
    if (const auto renderer = offscreen_renderer(); !renderer) GTEST_SKIP() << renderer.error().message;
  }
  static constexpr int kWidth = 320, kHeight = 200;
};

TEST_F(PictureTest, ShowsBodiesArrowsAndGroundWhereTheyAre) {
  const auto box = cuboid({0.05, 0.04, 0.03});
  Still still;
  // Far from the world's origin, where single precision alone would be off by millimetres.
  const glm::dvec3 far(12'345.6, -7'890.1, 500);
  still.bodies.push_back({&box, {{1, 0, 0, 0}, far}, {0.1F, 0.2F, 0.9F}});
  still.arrows.push_back({far + glm::dvec3(0, 0, 0.03), {0, 0, 2}});
  geometry::Box everything;
  everything.include(far - glm::dvec3(0.05, 0.04, 0.03));
  everything.include(far + glm::dvec3(0.05, 0.04, 0.1));
  const Camera camera = camera_for(everything, 1.6);
  const auto images = draw(still, {camera, closer(camera, std::array{still.arrows[0].p_WC_W}, 0.03)}, kWidth, kHeight);
  ASSERT_TRUE(images) << images.error().message;
  ASSERT_EQ(images->size(), 2u);
  const Image& image = images->front();

  const auto colour_at = [&](const glm::dvec3& p_W) {
    const glm::dvec2 at = seen_at(camera, p_W, kWidth, kHeight);
    return pixel(image, static_cast<int>(at.x), static_cast<int>(at.y));
  };
  const glm::ivec3 front = colour_at(far + glm::dvec3(0.0, -0.04, 0));
  EXPECT_GT(front.b, front.r + 60) << "the front of the blue box";
  const glm::ivec3 top = colour_at(far + glm::dvec3(0.03, 0.0, 0.03));
  EXPECT_GT(top.b, front.b) << "the light comes from above";
  const double arrow_m = 0.2 * 2 * glm::length(camera.eye_W - camera.target_W) * std::tan(camera.field_of_view_rad / 2);
  const glm::ivec3 shaft = colour_at(far + glm::dvec3(0, 0, 0.03 + 0.4 * arrow_m));
  EXPECT_GT(shaft.r, shaft.b + 60) << "half-way up the red arrow";
  const glm::ivec3 beyond = colour_at(far + glm::dvec3(0, 0, 0.03 + 1.2 * arrow_m));
  EXPECT_LT(std::abs(beyond.r - beyond.b), 60) << "above the arrow's tip";
  const glm::ivec3 corner = pixel(image, 2, 2);
  EXPECT_LT(std::abs(corner.r - corner.b), 60);
  EXPECT_GT(corner.g, 120) << "the background is light and grey";
}

TEST_F(PictureTest, ShowsEachVertexInItsColour) {
  const auto box = cuboid({0.05, 0.04, 0.03});
  std::vector<std::array<std::uint8_t, 3>> colours;
  for (const glm::dvec3& p : box.positions_O)
    colours.push_back(p.x < 0 ? std::array<std::uint8_t, 3>{230, 20, 20} : std::array<std::uint8_t, 3>{20, 220, 20});
  Still still;
  still.bodies.push_back({&box, {}, {0.1F, 0.2F, 0.9F}, colours});
  still.bodies.push_back({&box, {{1, 0, 0, 0}, {0.15, 0, 0}}, {0.1F, 0.2F, 0.9F}});
  const Camera camera = camera_for(box_around(still), 1.6);
  const auto images = draw(still, {camera}, kWidth, kHeight);
  ASSERT_TRUE(images) << images.error().message;
  const auto front = [&](double x) {
    const glm::dvec2 at = seen_at(camera, {x, -0.04, 0}, kWidth, kHeight);
    return pixel(images->front(), static_cast<int>(at.x), static_cast<int>(at.y));
  };
  EXPECT_GT(front(-0.04).r, front(-0.04).g + 60) << "its left is red";
  EXPECT_GT(front(0.04).g, front(0.04).r + 60) << "its right is green";
  EXPECT_LT(front(0.04).b, 100) << "the body's own colour is not to be seen";
  EXPECT_GT(front(0.15).b, front(0.15).r + 60) << "who has no colours of vertices has its own";
}

TEST_F(PictureTest, HiddenArrowsShineThrough) {
  const auto box = cuboid({0.05, 0.05, 0.05});
  Still still;
  still.bodies.push_back({&box, {}, {0.5F, 0.5F, 0.5F}});
  geometry::Box everything = bounding_box(box);
  const Camera camera = camera_for(everything, 1.6);
  const auto without = draw(still, {camera}, kWidth, kHeight);
  still.arrows.push_back({{0, 0, -0.03}, {0, 0, 1}});
  const auto with = draw(still, {camera}, kWidth, kHeight);
  ASSERT_TRUE(without && with);
  const glm::dvec2 at = seen_at(camera, {0, 0, -0.01}, kWidth, kHeight);
  const glm::ivec3 plain = pixel(without->front(), static_cast<int>(at.x), static_cast<int>(at.y));
  const glm::ivec3 through = pixel(with->front(), static_cast<int>(at.x), static_cast<int>(at.y));
  EXPECT_GT(through.r - through.b, plain.r - plain.b + 15);
  EXPECT_LT(through.r - through.b, 160) << "but only as a shimmer";
}

TEST_F(PictureTest, ABodyShadesTheGroundAndItsEdgesHaveNoSteps) {
  const auto plate = cuboid({0.05, 0.05, 0.002}), foot = cuboid({0.005, 0.005, 0.005});
  const glm::dvec3 raised(0, 0, 0.05), low(0, 0, -0.05);
  Still still;
  still.bodies.push_back({&plate, {{1, 0, 0, 0}, raised}, {0.9F, 0.1F, 0.1F}});
  still.bodies.push_back({&foot, {{1, 0, 0, 0}, low}, {0.1F, 0.9F, 0.1F}});
  const Camera camera = camera_for(box_around(still), 1.6);
  const auto images = draw(still, {camera}, kWidth, kHeight);
  ASSERT_TRUE(images) << images.error().message;
  const Image& image = images->front();

  // The light comes from (-0.45, -0.55, 1): the plate's shadow lies as far the other way as the plate is high.
  const double height_m = 0.1 + 0.005;
  const auto ground_at = [&](double x, double y) {
    const glm::dvec2 at = seen_at(camera, {x, y, -0.055}, kWidth, kHeight);
    return pixel(image, static_cast<int>(at.x), static_cast<int>(at.y)).g;
  };
  const double middle_x = 0.45 * height_m, middle_y = 0.55 * height_m;
  const int open = ground_at(middle_x - 0.09, middle_y);
  for (const double off_m : {-0.035, 0.0, 0.035})
    EXPECT_LT(ground_at(middle_x + off_m, middle_y), open - 40) << off_m << " m beside the shadow's middle";

  int edges = 0, smooth = 0;  // rows where red meets the light ground, and those where a pixel is between both
  for (int y = 1; y < kHeight - 1; ++y)
    for (int x = 2; x < kWidth - 2; ++x) {
      const auto is_plate = [&](int at) { return pixel(image, at, y).r > pixel(image, at, y).g + 60; };
      const auto is_ground = [&](int at) { return pixel(image, at, y).g > 190; };
      if (is_plate(x + 1) && is_ground(x - 1)) {
        ++edges;
        const int there = pixel(image, x, y).g;
        smooth += there > pixel(image, x + 1, y).g + 15 && there < pixel(image, x - 1, y).g - 15;
      }
    }
  EXPECT_GT(edges, 5);
  EXPECT_GT(2 * smooth, edges) << "of " << edges;
}

TEST_F(PictureTest, NothingToSeeIsAPictureToo) {
  const auto images = draw({}, {Camera{}}, 64, 40);
  ASSERT_TRUE(images) << images.error().message;
  EXPECT_EQ(images->front().rgba.size(), 64u * 40 * 4);
  EXPECT_FALSE(draw({}, {Camera{}}, 0, 40));
  EXPECT_FALSE(draw({}, {Camera{}}, 100'000, 40));
}

TEST(Png, IsAPng) {
  const Image image{2, 1, {255, 0, 0, 255, 0, 255, 0, 255}};
  const std::string bytes = png(image);
  EXPECT_EQ(bytes.substr(0, 8), "\x89PNG\r\n\x1a\n");
  EXPECT_EQ(bytes.substr(12, 12), std::string("IHDR\0\0\0\2\0\0\0\1", 12));
}

}  // namespace
}  // namespace farfeel::master_station
