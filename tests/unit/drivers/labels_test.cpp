// The driver without a device: a hand at rest, or a body as it stands in a clip's first frame.
#include <catch2/catch.hpp>

#include <string>
#include <vector>

#include "drivers/driver.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "proto/clip/clip.hpp"
#include "proto/clip/hand_clip.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/drivers/collect_sink.hpp"

namespace posed::drivers {
namespace {

constexpr const char* kFigure = R"(HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Spine
  {
    OFFSET 0 10 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 20 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.0333333
10 90 5 1 2 3 4 5 6
10 90 5 7 8 9 1 2 3
)";

const Driver& labels() { return *find_driver("labels"); }

Result<Device> opened(const Options& options) {
  TransportFactory ports;
  return labels().open(options, ports);
}

void beats(Decoder& decoder, int count, test::CollectSink& sink) {
  const std::vector<std::byte> bytes(static_cast<std::size_t>(count), std::byte{'\n'});
  decoder.feed(bytes, 0, sink);
}

}  // namespace

TEST_CASE("a stream of labels has the body of a clip, standing as in its first frame") {
  const test::TempFolder folder;
  const auto path = folder.write("figure.bvh", kFigure);
  const auto read = clip::read_clip(path);
  REQUIRE(read.has_value());
  auto device = opened({{"body", path.string()}, {"rate_hz", 60.0}});
  REQUIRE(device.has_value());
  CHECK(device->description.rate_hz == 60.0);
  CHECK(device->description.skeleton->id == read->skeleton->id);
  // A log has the description alone.
  const auto described = labels().describe(device->description.text, "walk.bvh");
  REQUIRE(described.has_value());
  CHECK(described->skeleton->id == read->skeleton->id);
  const auto decoder = labels().make_decoder(*described);
  REQUIRE(decoder.has_value());
  test::CollectSink sink;
  beats(**decoder, 3, sink);
  REQUIRE(sink.frames.size() == 3);
  const Frame first = read->frame(0);
  for (const Frame& frame : sink.frames) {
    CHECK(frame.rotation_xyzw == first.rotation_xyzw);
    CHECK(frame.root_position_m == first.root_position_m);
    CHECK(frame.source == Source::kLabels);
    CHECK(frame.quality == Quality::kHeld);
  }
  CHECK(sink.frames[2].header.device_ns == nanoseconds(2.0 / 60.0));
}

TEST_CASE("a stream of labels without a body is a hand at rest") {
  const auto device = opened({{"side", std::string("left")}});
  REQUIRE(device.has_value());
  CHECK(device->description.text == "left 30.000000");
  test::CollectSink sink;
  beats(*device->decoder, 1, sink);
  REQUIRE(sink.frames.size() == 1);
  CHECK(hand_angles(sink.frames[0]) == HandAngles{});
}

TEST_CASE("what cannot perform labels is refused") {
  const test::TempFolder folder;
  const auto hand = folder.path() / "hand.csv";
  clip::HandClip still;
  still.rate_hz = 30.0;
  still.angles.resize(10);
  for (int t = 0; t < 10; ++t) still.time_s.push_back(t / 30.0);
  REQUIRE(clip::write_hand_csv(still, hand));
  const auto refused = opened({{"body", hand.string()}});
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().message.find("is no clip of a body") != std::string::npos);
  CHECK_FALSE(opened({{"body", (folder.path() / "none.bvh").string()}}).has_value());
  for (const char* text :
       {"", "body 30", "body 30 5\n", "body 30 5\nab", "body 0 1\n\n",
        "body 30 18446744073709551615\nx", "right 30\n", "middle 30", "body 30 2\n1\nHIERARCHY"}) {
    INFO(text);
    CHECK_FALSE(labels().describe(text, "test").has_value());
  }
}

}  // namespace posed::drivers
