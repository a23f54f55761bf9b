#include "proto/message/frame_message.hpp"

#include <catch2/catch.hpp>

namespace posed::message {

TEST_CASE("a frame's message has its timecode, and none when the next frame has none") {
  FrameEncoder encoder("walker");
  Frame frame;
  frame.timecode = to_timecode("01:02:03:04");
  CHECK(encoder.encode(frame).timecode() == "01:02:03:04");
  frame.timecode = to_timecode("10:20:30.405");
  CHECK(encoder.encode(frame).timecode() == "10:20:30.405");
  frame.timecode = {};
  CHECK(encoder.encode(frame).timecode().empty());
}

}  // namespace posed::message
