// What the publisher hands to outputs.
#include "daemon/publish/frame_output.hpp"

#include <string>

#include <catch2/catch.hpp>

#include "tests/unit/daemon/publish/publisher_rig.hpp"

namespace posed::publish {
namespace {

// Writes down what it gets: "+toy 1 2 s1 -0".
class NotingOutput final : public FrameOutput {
 public:
  explicit NotingOutput(std::string wanted) : wanted_(std::move(wanted)) {}
  [[nodiscard]] bool wants(std::string_view stream) const noexcept override {
    return stream == wanted_;
  }
  void stream_comes(const StreamInfo& stream) override {
    CHECK(stream.skeleton != nullptr);
    noted += "+" + stream.name + " ";
  }
  void frame(const Frame& frame) noexcept override {
    noted += std::to_string(frame.header.sequence) + " ";
  }
  void sample(const Sample& sample) noexcept override {
    noted += "s" + std::to_string(sample.header.sequence) + " ";
  }
  void stream_leaves(std::uint32_t stream) noexcept override {
    noted += "-" + std::to_string(stream) + " ";
  }
  void fill(v1::OutputStats& stats) const override { stats.set_name(wanted_); }

  std::string noted;

 private:
  std::string wanted_;
};

pipeline::Item toy_sample_item(std::uint64_t sequence) {
  pipeline::Item item;
  item.kind = pipeline::Item::Kind::kSample;
  item.sample = {};
  item.sample.header.sequence = sequence;
  return item;
}

}  // namespace

TEST_CASE(
    "an output gets the final frames and samples of the streams that it wants, and no others") {
  NotingOutput toy("toy"), late("late"), raw("toy-raw");
  PublisherRig rig(false, {&toy, &late, &raw});
  rig.put(toy_frame_item(1));  // before the publisher's first turn
  static_cast<void>(rig.publisher->turn(0));
  pipeline::Item before_stages = toy_frame_item(2);
  before_stages.kind = pipeline::Item::Kind::kRawFrame;
  rig.put(before_stages);
  rig.put(toy_frame_item(2));
  rig.put(toy_sample_item(9));
  static_cast<void>(rig.publisher->turn(1));
  CHECK(toy.noted == "+toy 1 2 s9 ");
  CHECK(late.noted.empty());
  CHECK(raw.noted.empty());

  // A stream that comes, changes its skeleton and leaves.
  rig.publisher->add(rig.toy_info("late", pipeline::stream_id(1, 1)));
  static_cast<void>(rig.publisher->turn(2));
  rig.put(toy_frame_item(1, pipeline::stream_id(1, 1)));
  rig.publisher->add(rig.toy_info("late", pipeline::stream_id(1, 2)));
  rig.put(toy_frame_item(2, pipeline::stream_id(1, 2)));
  static_cast<void>(rig.publisher->turn(3));
  rig.publisher->remove(pipeline::stream_id(1, 1));
  rig.publisher->remove(pipeline::stream_id(1, 2));
  CHECK(late.noted == "+late 1 -65537 +late 2 -131073 ");
  const v1::Stats stats = rig.publisher->stats();
  REQUIRE(stats.output_size() == 3);
  CHECK(stats.output(1).name() == "late");
}

}  // namespace posed::publish
