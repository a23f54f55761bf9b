// A whole log as MCAP: what the run published, in a file that other programs open.
#include <catch2/catch.hpp>

#include <map>
#include <sstream>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/dynamic_message.h>

#include "daemon/tools/export/log_mcap.hpp"
#include "posed/foxglove/frame_transforms.pb.h"
#include "proto/log/reader.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/has.hpp"
#include "tests/unit/daemon/tools/replay/mcap_reader.hpp"
#include "tests/unit/daemon/tools/replay/staged_run.hpp"

namespace posed::test {
namespace {

constexpr std::size_t kLogFrames = 120;

bool go_on() { return false; }

// The frames that the log holds of a stream, as messages.
std::vector<std::string> logged(const log::Reader& reader, std::uint32_t stream, bool raw) {
  std::vector<std::string> messages;
  auto frames = reader.frames(stream, raw);
  REQUIRE(frames);
  std::uint64_t last = 0;
  for (;;) {
    const auto row = frames->next();
    REQUIRE(row);
    if (!*row) return messages;
    if ((*row)->sequence <= last) continue;  // repeated while the stream was stale
    last = (*row)->sequence;
    messages.emplace_back(reinterpret_cast<const char*>((*row)->bytes.data()),
                          (*row)->bytes.size());
  }
}

std::vector<const McapMessage*> of_topic(const McapReader& mcap, const std::string& topic) {
  std::vector<const McapMessage*> found;
  for (const McapMessage& message : mcap.messages) {
    if (message.topic == topic) found.push_back(&message);
  }
  return found;
}

}  // namespace

TEST_CASE("an MCAP holds every published frame of a log, byte for byte") {
  const TempFolder folder;
  const auto log = folder.path() / "take.plog";
  write_staged_log(log, kLogFrames);
  const auto out = folder.path() / "take.mcap";
  const auto summary = tools::write_mcap(log, out, go_on);
  if (!summary) FAIL(summary.error().text());
  CHECK(summary->warnings.empty());
  const McapReader mcap(file_text(out));
  CHECK(mcap.messages.size() == summary->messages);
  // Pose, skeleton and transforms of two streams, styled and raw; their events.
  CHECK(summary->topics == 14);
  const auto reader = log::Reader::open(log);
  REQUIRE(reader);
  const std::int64_t offset_ns = std::stoll(reader->meta().at("monotonic_to_utc_ns"));
  for (const std::uint32_t stream : {0U, 1U}) {
    for (const bool raw : {false, true}) {
      const std::string name = std::string(stream == 0 ? "a" : "b") + (raw ? "-raw" : "");
      INFO(name);
      const auto expected = logged(*reader, stream, raw);
      const auto made = of_topic(mcap, "pose/" + name);
      REQUIRE(expected.size() > kLogFrames - 10);
      REQUIRE(made.size() == expected.size());
      for (std::size_t i = 0; i < made.size(); ++i) {
        v1::Frame given, read;
        REQUIRE(given.ParseFromString(expected[i]));
        REQUIRE(read.ParseFromString(made[i]->data));
        CHECK(read.SerializeAsString() == given.SerializeAsString());
        CHECK(made[i]->sequence == given.sequence());
        CHECK(made[i]->log_ns == static_cast<std::uint64_t>(given.arrival_ns() + offset_ns));
        CHECK(made[i]->schema == "posed.v1.Frame");
      }
      const auto skeletons = of_topic(mcap, "skeleton/" + name);
      REQUIRE(skeletons.size() == 1);
      v1::Skeleton skeleton;
      REQUIRE(skeleton.ParseFromString(skeletons.front()->data));
      v1::Frame first;
      REQUIRE(first.ParseFromString(made.front()->data));
      CHECK(skeleton.id() == first.skeleton_id());
      CHECK(skeletons.front() < made.front());
      const auto shown = of_topic(mcap, "tf/" + name);
      REQUIRE(shown.size() == made.size());
      foxglove::FrameTransforms transforms;
      REQUIRE(transforms.ParseFromString(shown.back()->data));
      REQUIRE(transforms.transforms_size() == skeleton.joint_name_size());
      CHECK(shown.back()->schema == "foxglove.FrameTransforms");
      CHECK(shown.back()->log_ns == made.back()->log_ns);
      const auto& root = transforms.transforms(0);
      CHECK(root.parent_frame_id() == "world");
      CHECK(root.child_frame_id() == name + "/" + skeleton.joint_name(0));
      v1::Frame last;
      REQUIRE(last.ParseFromString(made.back()->data));
      CHECK(root.rotation().x() == Approx(last.rotation_xyzw(2)).margin(1e-6));
      CHECK(root.rotation().y() == Approx(last.rotation_xyzw(0)).margin(1e-6));
    }
  }
}

TEST_CASE("an MCAP holds the events that a replay computes") {
  const TempFolder folder;
  write_staged_log(folder.path() / "take.plog", kLogFrames);
  REQUIRE(tools::write_mcap(folder.path() / "take.plog", folder.path() / "take.mcap", go_on));
  const McapReader mcap(file_text(folder.path() / "take.mcap"));
  const auto reader = log::Reader::open(folder.path() / "take.plog");
  REQUIRE(reader);
  const std::int64_t offset_ns = std::stoll(reader->meta().at("monotonic_to_utc_ns"));
  std::map<int, std::string> texts;  // by kind, the last one
  for (const McapMessage* message : of_topic(mcap, "event/a")) {
    CHECK(message->schema == "posed.v1.Event");
    v1::Event event;
    REQUIRE(event.ParseFromString(message->data));
    CHECK(event.stream() == "a");
    CHECK(message->log_ns == static_cast<std::uint64_t>(event.time_ns() + offset_ns));
    texts[event.kind()] = event.text();
  }
  CHECK(texts[v1::Event::KIND_STARTED] == "the first data came");
  CHECK(has(texts[v1::Event::KIND_CONTROL], "style"));
  CHECK(has(texts[v1::Event::KIND_SHED], "skipped: newer ones waited"));
}

TEST_CASE("the schema in an MCAP is enough to decode its messages") {
  const TempFolder folder;
  write_staged_log(folder.path() / "take.plog", 30);
  REQUIRE(tools::write_mcap(folder.path() / "take.plog", folder.path() / "take.mcap", go_on));
  const McapReader mcap(file_text(folder.path() / "take.mcap"));
  google::protobuf::FileDescriptorSet set;
  REQUIRE(set.ParseFromString(mcap.schemas.at("posed.v1.Frame")));
  google::protobuf::DescriptorPool pool;
  for (const auto& file : set.file()) REQUIRE(pool.BuildFile(file) != nullptr);
  const auto* type = pool.FindMessageTypeByName("posed.v1.Frame");
  REQUIRE(type != nullptr);
  google::protobuf::DynamicMessageFactory factory(&pool);
  const auto message =
      std::unique_ptr<google::protobuf::Message>(factory.GetPrototype(type)->New());
  REQUIRE(message->ParseFromString(of_topic(mcap, "pose/a").back()->data));
  const auto* stream = type->FindFieldByName("stream");
  CHECK(message->GetReflection()->GetString(*message, stream) == "a");
  CHECK(message->GetReflection()->FieldSize(*message, type->FindFieldByName("rotation_xyzw")) > 0);
}

TEST_CASE("a log that cannot be replayed, and a stop, leave no MCAP") {
  const TempFolder folder;
  const auto out = folder.path() / "take.mcap";
  CHECK_FALSE(tools::write_mcap(folder.write("no.plog", "no log"), out, go_on));
  const auto log = folder.path() / "take.plog";
  write_staged_log(log, 30);
  const auto stopped = tools::write_mcap(log, out, [] { return true; });
  REQUIRE_FALSE(stopped);
  CHECK(has(stopped.error().message, "interrupted"));
  CHECK_FALSE(std::filesystem::exists(out));
  CHECK_FALSE(tools::write_mcap(log, folder.path() / "nowhere/take.mcap", go_on));
}

TEST_CASE("an MCAP of many messages has many chunks, of none it is complete, too") {
  std::ostringstream none;
  tools::McapWriter empty(none, "test");
  empty.finish();
  CHECK(McapReader(none.str()).messages.empty());
  std::ostringstream many;
  tools::McapWriter writer(many, "test");
  const auto schema = writer.add_schema("a.B", "descriptors");
  const auto one = writer.add_channel(schema, "one");
  const auto two = writer.add_channel(schema, "two");
  for (std::uint32_t i = 0; i < 5000; ++i) {
    writer.add(i % 3 == 0 ? one : two, i, 1'000'000 - i, std::string(i % 2000, 'x'));
  }
  writer.finish();
  const McapReader read(many.str());
  CHECK(read.chunks > 3);
  REQUIRE(read.messages.size() == 5000);
  for (std::uint32_t i = 0; i < 5000; ++i) {
    CHECK(read.messages[i].sequence == i);
    CHECK(read.messages[i].topic == (i % 3 == 0 ? "one" : "two"));
    CHECK(read.messages[i].data.size() == i % 2000);
  }
}

}  // namespace posed::test
