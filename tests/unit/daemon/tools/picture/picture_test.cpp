// Pictures of poses: projection, figures, strips and the programs that make pixels of them.
#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <fstream>
#include <string>

#include "daemon/tools/picture/figure.hpp"
#include "daemon/tools/picture/picture_file.hpp"
#include "daemon/tools/picture/strip.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::picture {
namespace {

using Eigen::Vector3d;

constexpr std::array kViews{View::kFront, View::kSide, View::kThreeQuarter};

clip::Clip picture_walk() {
  auto walk = motion::make_walker({.seconds = 2.0});
  REQUIRE(walk);
  return *walk;
}

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++count;
  }
  return count;
}

StripRow row_of(const FigureShape& shape, const clip::Clip& clip) {
  StripRow row;
  for (int i = 0; i < clip.frames(); i += 10) {
    row.poses.push_back({.figure = shape.pose(clip.frame(i)), .caption = std::to_string(i)});
  }
  return row;
}

TEST_CASE("a picture shows a walker's way to the right in a side view", "[picture]") {
  const Facing facing;  // towards +Z
  const Seen ahead = Camera(View::kSide, facing).see({0.0, 2.0, 3.0});
  CHECK(ahead.right_m == Approx(3.0));
  CHECK(ahead.up_m == Approx(2.0));
  // A figure that looks at the camera has its left hand (+X) at the right.
  const Seen left_hand = Camera(View::kFront, facing).see({1.0, 0.0, 0.5});
  CHECK(left_hand.right_m == Approx(1.0));
  CHECK(left_hand.near_m == Approx(0.5));
  CHECK_FALSE(view_from_name("above"));
}

TEST_CASE("every view of a picture keeps lengths", "[picture]") {
  for (const View view : kViews) {
    const Camera camera(view, {});
    for (const Vector3d& point : {Vector3d(1.0, 0.0, 0.0), Vector3d(0.3, -2.0, 0.7)}) {
      const Seen seen = camera.see(point);
      CHECK(std::hypot(seen.right_m, seen.up_m, seen.near_m) == Approx(point.norm()));
    }
  }
}

TEST_CASE("a body is drawn as sticks with a head above its neck", "[picture]") {
  const clip::Clip walk = picture_walk();
  const FigureShape shape(walk.skeleton);
  const Figure figure = shape.pose(walk.frame(0));
  CHECK_FALSE(shape.is_hand());
  REQUIRE(figure.head);
  double left = 0, right = 0, highest_m = 0.0;
  for (const Stick& stick : figure.sticks) {
    left += stick.colour == "#0072b2" ? 1 : 0;
    right += stick.colour == "#d55e00" ? 1 : 0;
    highest_m = std::max(highest_m, stick.to_m.y());
  }
  CHECK(left > 4);
  CHECK(left == right);
  CHECK(figure.head->centre_m.y() > highest_m - figure.head->radius_m);
}

TEST_CASE("a hand is drawn as capsules with its fingers upwards", "[picture]") {
  for (const Side side : {Side::kLeft, Side::kRight}) {
    const auto skeleton = std::make_shared<const Skeleton>(hand_skeleton(side));
    const FigureShape shape(skeleton);
    REQUIRE(shape.is_hand());
    Frame frame;
    set_hand_angles(*skeleton, {}, frame);
    const Figure figure = shape.pose(frame);
    CHECK_FALSE(figure.head);
    CHECK(figure.sticks.size() == 5 + 15);
    const Camera camera(View::kFront, shape.facing(1.0));
    const Seen thumb = camera.see(figure.sticks.front().to_m);
    const Seen little_tip = camera.see(figure.sticks.back().to_m);
    CHECK(little_tip.up_m > 0.1);  // of a flat hand, the wrist at 0
    // Palm to the camera: the thumb of a right hand is at the right.
    CHECK((thumb.right_m > little_tip.right_m) == (side == Side::kRight));
  }
}

TEST_CASE("a strip has room for every pose", "[picture]") {
  const clip::Clip walk = picture_walk();
  const FigureShape shape(walk.skeleton);
  const std::vector<StripRow> rows{row_of(shape, walk)};
  for (const View view : kViews) {
    const Camera camera(view, shape.facing(0.0));
    const StripLayout layout = layout_of(rows, camera, 260.0, true);
    CHECK((layout.top_m - layout.bottom_m) * layout.px_per_m == Approx(260.0));
    for (const StripPose& pose : rows.front().poses) {
      const Seen place = camera.see(pose.figure.place_m);
      for (const Stick& stick : pose.figure.sticks) {
        const Seen seen = camera.see(stick.to_m);
        CHECK(seen.right_m - place.right_m >= layout.left_m);
        CHECK(seen.right_m - place.right_m <= layout.right_m);
        CHECK(seen.up_m - place.up_m >= layout.bottom_m);
        CHECK(seen.up_m - place.up_m <= layout.top_m);
      }
    }
  }
}

TEST_CASE("a strip's picture has a column for each pose and tells what is to be seen",
          "[picture]") {
  const clip::Clip walk = picture_walk();
  const FigureShape shape(walk.skeleton);
  std::vector<StripRow> rows{row_of(shape, walk), row_of(shape, walk)};
  rows.front().title = "raw <&> \x1b[31m";
  rows.front().pale = true;
  const Camera camera(View::kSide, shape.facing(0.0));
  const auto layout = layout_of(rows, camera, 100.0, true);
  const std::string svg = strip_svg(rows, camera, layout, {.title = "t", .sentence = "See it."});
  CHECK(count_of(svg, "class=\"time\"") == 2 * rows.front().poses.size());
  CHECK(count_of(svg, "<circle") == 2 * rows.front().poses.size());
  CHECK(svg.find("See it.") != std::string::npos);
  CHECK(svg.find("raw &lt;&amp;&gt; \\x1b[31m") != std::string::npos);
  CHECK(svg.find("nan") == std::string::npos);
  // Only the second row has colours.
  const std::size_t second = svg.find("class=\"time\"", svg.find("class=\"row\""));
  CHECK(svg.substr(0, second).find("#0072b2") == std::string::npos);
  CHECK(svg.find("#0072b2") != std::string::npos);
}

TEST_CASE("a program that is not there is an error that names its package", "[picture]") {
  const auto done = run_program({"posed-has-no-such-program"}, "some-package");
  REQUIRE_FALSE(done);
  CHECK(done.error().message.find("apt install some-package") != std::string::npos);
  CHECK(run_program({"true"}, "coreutils"));
  const auto failed = run_program({"ls", "/posed-has-no-such-folder"}, "coreutils");
  REQUIRE_FALSE(failed);
  CHECK(failed.error().message.find("posed-has-no-such-folder") != std::string::npos);
}

TEST_CASE("a PNG has the size of its drawing", "[picture]") {
  const test::TempFolder folder;
  const auto path = folder.path() / "strip.png";
  const clip::Clip walk = picture_walk();
  const FigureShape shape(walk.skeleton);
  const std::vector<StripRow> rows{row_of(shape, walk)};
  const Camera camera(View::kSide, shape.facing(0.0));
  const std::string svg = strip_svg(rows, camera, layout_of(rows, camera, 100.0, true), {});
  const auto done = write_picture(svg, path);
  if (!done && done.error().message.find("not installed") != std::string::npos) {
    WARN("SKIPPED without rsvg-convert");
    return;
  }
  REQUIRE(done);
  std::ifstream file(path, std::ios::binary);
  std::array<unsigned char, 24> head{};
  file.read(reinterpret_cast<char*>(head.data()), head.size());
  CHECK(std::string(head.begin() + 1, head.begin() + 4) == "PNG");
  const std::string wanted = "width=\"";
  const double width_px = std::stod(svg.substr(svg.find(wanted) + wanted.size()));
  CHECK(head[18] * 256 + head[19] == Approx(width_px).margin(1.0));
}

}  // namespace
}  // namespace posed::picture
