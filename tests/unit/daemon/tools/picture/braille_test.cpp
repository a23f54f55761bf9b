// Poses as text: where the dots are, how much room they take, and that wild numbers draw nothing.
#include "daemon/tools/picture/braille.hpp"

#include <limits>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include "models/motion/synthetic_walker.hpp"

namespace posed::picture {
namespace {

using Eigen::Vector3d;
using Lines = std::vector<std::string>;

// Seen from the front, right is +X and up is +Y.
const Camera kFrontCamera(View::kFront, Facing{});

Stick stick(const Vector3d& from_m, const Vector3d& to_m) {
  return {.from_m = from_m, .to_m = to_m, .width_m = 0.0, .colour = "#000"};
}

StripLayout room_of(const Figure& figure, const Camera& camera) {
  return layout_of({StripRow{.title = {}, .pale = false, .poses = {{figure, {}}}}}, camera, 1.0,
                   false);
}

// The number of characters, each of which is a blank or a braille pattern; -1: another is there.
int characters(const std::string& row) {
  int count = 0;
  for (std::size_t i = 0; i < row.size(); ++count) {
    const bool pattern = row.size() - i >= 3 && row[i] == '\xe2' &&
                         (static_cast<unsigned char>(row[i + 1]) & 0xfc) == 0xa0;
    if (!pattern && row[i] != ' ') return -1;
    i += pattern ? 3 : 1;
  }
  return count;
}

TEST_CASE("lines of a figure become dots of braille", "[braille]") {
  Figure figure;
  const auto drawn = [&](int columns) {
    return braille(figure, kFrontCamera, room_of(figure, kFrontCamera), columns, 2);
  };
  figure.sticks.push_back(stick({0.0, 0.0, 0.0}, {0.0, 7.0, 0.0}));  // from the ground upwards
  CHECK(drawn(1) == Lines{"⢸", "⢸"});
  figure.sticks[0] = stick({-1.0, 0.0, 0.0}, {1.0, 0.0, 0.0});  // on the ground
  CHECK(drawn(2) == Lines{"  ", "⣀⣀"});
}

TEST_CASE("a figure of braille lies in the middle and keeps the scale of its room", "[braille]") {
  Figure figure;
  figure.sticks.push_back(stick({0.0, 0.0, 0.0}, {0.0, 1.0, 0.0}));
  StripLayout room = room_of(figure, kFrontCamera);
  CHECK(braille(figure, kFrontCamera, room, 5, 2) == Lines{"  ⢸  ", "  ⢸  "});
  room.top_m = 2.0;  // another pose is twice as high
  CHECK(braille(figure, kFrontCamera, room, 5, 2) == Lines{"     ", "  ⢸  "});
  room.top_m = 0.5;  // what is larger than the room is cut off
  CHECK(braille(figure, kFrontCamera, room, 5, 2) == Lines{"  ⢸  ", "  ⢸  "});
}

TEST_CASE("a walker fills the height of its braille, and every row has all columns", "[braille]") {
  const auto walk = motion::make_walker({.seconds = 1.0});
  REQUIRE(walk);
  const FigureShape shape(walk->skeleton);
  const Camera camera(View::kThreeQuarter, shape.facing(0.0));
  const Figure figure = shape.pose(walk->frame(7));
  const Lines lines = braille(figure, camera, room_of(figure, camera), 30, 12);
  REQUIRE(lines.size() == 12);
  for (const std::string& line : lines) CHECK(characters(line) == 30);
  CHECK(lines.front() != std::string(30, ' '));
  CHECK(lines.back() != std::string(30, ' '));
}

TEST_CASE("numbers that are no pose draw nothing in braille", "[braille]") {
  for (const double wild :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e300}) {
    Figure figure;
    figure.sticks.push_back(stick({0.0, 0.0, 0.0}, {0.0, 1.0, 0.0}));
    const StripLayout room = room_of(figure, kFrontCamera);
    figure.sticks[0].to_m.y() = wild;
    CHECK(braille(figure, kFrontCamera, room, 3, 1) == Lines{"   "});
    figure.head = {.centre_m = {wild, 0.0, 0.0}, .radius_m = wild};
    figure.place_m.x() = wild;
    CHECK(characters(braille(figure, kFrontCamera, room_of(figure, kFrontCamera), 3, 1)[0]) == 3);
  }
}

}  // namespace
}  // namespace posed::picture
