// The builder of streams from descriptions, with the test in the place of reader, worker and the
// other users of streams.
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include "daemon/devices/source_builder.hpp"
#include "daemon/pipeline/description_row.hpp"
#include "drivers/options.hpp"
#include "drivers/template_mocap/protocol.hpp"
#include "models/merge/merge_stage.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "models/stages/registry.hpp"
#include "models/style/live/style_type.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/models/style/toy_style.hpp"

namespace posed::devices {
namespace {

using drivers::mocap::BodyEntry;

constexpr std::int64_t kStep_ns = SourceBuilder::kBetweenUpdates_ns;

BodyEntry person(std::uint16_t id, const std::string& name, int joints = 2) {
  BodyEntry body{.id = id, .name = name, .joints = {}};
  for (int j = 0; j < joints; ++j) {
    body.joints.push_back(
        {.name = "j" + std::to_string(j), .parent = j - 1, .offset_m = {0.0F, 0.3F, 0.0F}});
  }
  return body;
}

// A builder for one source "room" with `slots` slots, and for these devices with one body, each
// with a slot of its own.
class Room final : private StreamHost {
 public:
  explicit Room(std::uint32_t slots, config::SourceConfig config = {},
                const std::vector<config::StreamConfig>& devices = {},
                std::size_t max_made = SourceBuilder::kMaxMade) {
    for (const config::StreamConfig& device : devices) {
      ModelFiles files;
      sources_.push_back(open_source(config::source_of(device), files).value());
      sources_.back()->exchange = std::make_unique<pipeline::BodyExchange>(*wake_, false);
    }
    auto source = std::make_unique<OpenSource>();
    source->config = std::move(config);
    source->config.name = "room";
    source->config.all = true;
    source->driver = drivers::find_driver("template_mocap");
    source->exchange = std::make_unique<pipeline::BodyExchange>(*wake_, true);
    sources_.push_back(std::move(source));
    for (std::uint32_t i = 0; i < sources_.size(); ++i) sources_[i]->number = i;
    const auto all = static_cast<std::uint32_t>(devices.size()) + slots;
    builder_.emplace(sources_, all, std::set<std::string>{"walker"}, models_, kept,
                     static_cast<StreamHost&>(*this), max_made);
    REQUIRE(builder_->open());
    builder_->begin();
  }

  // The device describes these bodies, and all that follows is done. What the reader is given is
  // in `update`.
  void describe(const std::vector<BodyEntry>& bodies) {
    const auto datagram = drivers::mocap::encode_description(bodies);
    describe_bytes(std::span(datagram).subspan(8, datagram.size() - 12));
  }
  void describe_bytes(std::span<const std::byte> bytes) {
    sources_.back()->exchange->descriptions->put(bytes);
    settle();
  }

  // Turns until nothing is due, with the reader and the worker doing their part at once.
  void settle() {
    for (int i = 0; i < 8; ++i) {
      now_ns_ += kStep_ns;
      static_cast<void>(builder_->turn(now_ns_));
      for (const auto& source : sources_) accept_update(*source);
    }
  }

  // So much time passes, and what is due then is done.
  void pass(std::int64_t time_ns) {
    now_ns_ += time_ns;
    settle();
  }

  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> all;
    for (const pipeline::ReadBody& body : update->bodies) {
      const auto stream = running.find(body.stream);
      all.push_back(stream == running.end() ? "" : stream->second);
    }
    return all;
  }

  // The id of the stream that runs under this name.
  [[nodiscard]] std::uint32_t id_of(const std::string& name) const {
    for (const auto& [id, running_name] : running) {
      if (running_name == name) return id;
    }
    return pipeline::kNoStream;
  }

  KeptSettings kept;
  std::map<std::uint32_t, std::string> running;                     // names by stream
  std::map<std::uint32_t, pipeline::StreamSettings> settings;       // of all that ran
  std::map<std::uint32_t, std::string> refused;                     // sentences by stream
  std::map<std::uint32_t, std::weak_ptr<const StageModel>> models;  // of their first stage
  const pipeline::SourceUpdate* update = nullptr;                   // of the room
  std::vector<std::string> warnings;
  int alive = 0;                // signs of life
  std::set<int> alive_at_adds;  // as many as there had been when each stream was added
  std::size_t adds = 0;
  std::size_t stop_at = 0;  // the builder is stopped when it adds this stream, from 1; 0: never

 private:
  // As the reader, and then the worker.
  void accept_update(OpenSource& source) {
    static_cast<void>(source.exchange->updates.consume([&](const pipeline::SourceUpdate* given) {
      std::set<std::uint32_t> now;
      for (const pipeline::ReadBody& body : given->bodies) now.insert(body.stream);
      for (const auto& [id, name] : running) {
        if (source_of_[id] == source.number && !now.contains(id)) gone_.push_back(id);
      }
      if (source.has_several()) update = given;
      CHECK(source.exchange->taken.push(given));
    }));
  }

  void is_alive() noexcept override { ++alive; }
  pipeline::StreamCounters& counters(std::uint32_t stream) override {
    return counters_.at(pipeline::slot_of(stream));
  }
  void add(NewStream stream) override {
    alive_at_adds.insert(alive);
    ++adds;
    if (stream.engine) running[stream.id] = stream.config.name;
    settings[stream.id] = stream.stages.settings;
    if (!stream.bound.models.empty()) {
      models[stream.id] = bound_[stream.id] = stream.bound.models.front();
    }
    source_of_[stream.id] = stream.source.number;
    if (!stream.engine) refused[stream.id] = stream.refusal;
    if (stop_at > 0 && running.size() == stop_at) builder_->stop();
  }
  std::optional<std::uint32_t> next_gone() override {
    if (gone_.empty()) return std::nullopt;
    const std::uint32_t id = gone_.back();
    gone_.pop_back();
    return id;
  }
  void remove(std::uint32_t stream) override {
    CHECK(running.erase(stream) + refused.erase(stream) == 1);
    bound_.erase(stream);
  }
  void call_reader() override {}
  void warn(const OpenSource&, const std::string& sentence) override {
    warnings.push_back(sentence);
  }

  std::unique_ptr<system::EventFd> wake_ = system::EventFd::open().value();
  std::vector<std::unique_ptr<OpenSource>> sources_;
  std::map<std::uint32_t, std::uint32_t> source_of_;  // by stream
  std::map<std::uint32_t, std::shared_ptr<const StageModel>> bound_;
  std::array<pipeline::StreamCounters, 16> counters_;
  std::vector<std::uint32_t> gone_;
  ModelFiles models_;
  std::optional<SourceBuilder> builder_;
  std::int64_t now_ns_ = 0;
};

using Names = std::vector<std::string>;

// A person with arms but without fingers, or the left hand of one as a body of its own.
BodyEntry with_joints(std::uint16_t id, const std::string& name,
                      const std::vector<std::pair<std::string, int>>& joints) {
  BodyEntry body{.id = id, .name = name, .joints = {}};
  for (const auto& [joint, parent] : joints) {
    body.joints.push_back({.name = joint, .parent = parent, .offset_m = {0.1F, 0.0F, 0.0F}});
  }
  return body;
}
BodyEntry walking_person(std::uint16_t id, const std::string& name) {
  return with_joints(id, name,
                     {{"Hips", -1},
                      {"Spine", 0},
                      {"Head", 1},
                      {"LeftArm", 1},
                      {"LeftForeArm", 3},
                      {"LeftHand", 4},
                      {"RightArm", 1},
                      {"RightForeArm", 6},
                      {"RightHand", 7}});
}
BodyEntry left_hand(std::uint16_t id, const std::string& name) {
  std::vector<std::pair<std::string, int>> joints{{"LeftHand", -1}};
  for (const char* finger : {"Thumb", "Index", "Middle", "Ring", "Pinky"}) {
    for (int joint = 1; joint <= 3; ++joint) {
      const int parent = joint == 1 ? 0 : static_cast<int>(joints.size()) - 1;
      joints.emplace_back("LeftHand" + std::string(finger) + std::to_string(joint), parent);
    }
  }
  return with_joints(id, name, joints);
}

config::StreamConfig merged_with(const std::string& partner) {
  const StageType& merge = merge::merge_type();
  config::StreamConfig config;
  config.stages.push_back(
      {.type = &merge,
       .parameters = complete_parameters(merge.parameters, {{"left", partner}}).value()});
  return config;
}

}  // namespace

TEST_CASE("a stop takes effect between two bodies, and the reader gets no half description") {
  Room room(8);
  room.describe({person(1, "Ann")});
  const pipeline::SourceUpdate* const before = room.update;
  room.stop_at = 3;
  room.describe({person(1, "Ann"), person(2, "Bob"), person(3, "Cay"), person(4, "Dee")});
  CHECK(room.running.size() == 3);
  CHECK(room.update == before);
  room.describe({person(1, "Ann")});
  CHECK(room.running.size() == 3);
}

TEST_CASE("bodies become streams with names, slots and generations of their own") {
  Room room(8);
  room.describe({person(1, "Ann"), person(2, "Bob"), person(3, "ann"), person(4, "bob")});
  CHECK(room.names() == Names{"room-ann", "room-bob", "room-ann-2", "room-bob-2"});
  const std::uint32_t bob = room.update->bodies[1].stream;

  // Another skeleton: the same name and slot, the next generation. The others stay as they are.
  const std::uint32_t ann = room.update->bodies[0].stream;
  room.describe({person(1, "Ann"), person(2, "Bob", 5), person(3, "ann"), person(4, "bob")});
  CHECK(room.names() == Names{"room-ann", "room-bob", "room-ann-2", "room-bob-2"});
  CHECK(room.update->bodies[0].stream == ann);
  CHECK(room.update->bodies[1].stream == StreamSlots::next(bob));

  // Who returns has its name and goes on with its numbers.
  room.describe({person(2, "Bob", 5)});
  CHECK(room.running.size() == 1);
  room.describe({person(2, "Bob", 5), person(3, "ann")});
  CHECK(room.names() == Names{"room-bob", "room-ann-2"});
  CHECK(room.warnings.empty());
  const auto row = pipeline::unpack_description(room.update->log);
  REQUIRE(row);
  CHECK(row->streams == std::vector{room.update->bodies[0].stream, room.update->bodies[1].stream});
}

TEST_CASE("a description that cannot be used changes nothing and is told once") {
  Room room(8);
  room.describe({person(1, "Ann")});
  const auto* const before = room.update;
  const std::array<std::byte, 3> cut{std::byte{2}, std::byte{0}, std::byte{9}};
  room.describe_bytes(cut);
  room.describe_bytes(cut);
  CHECK(room.update == before);
  REQUIRE(room.warnings.size() == 1);
  CHECK_THAT(room.warnings[0], Catch::Contains("describes its bodies in a way"));
}

TEST_CASE("a body without a free slot is told of, and streamed as soon as one is free") {
  Room room(2);
  room.describe({person(1, "Ann"), person(2, "Bob"), person(3, "Cleo")});
  CHECK(room.names() == Names{"room-ann", "room-bob", ""});
  REQUIRE(room.warnings.size() == 1);
  CHECK_THAT(room.warnings[0], Catch::Contains("1 of its bodies are not streamed"));
  // Bob's slot is free only after he has left, when Cleo was already refused one.
  room.describe({person(1, "Ann"), person(3, "Cleo")});
  CHECK(room.names() == Names{"room-ann", "room-cleo"});
}

TEST_CASE("a body that the config names always has a slot") {
  config::SourceConfig config;
  config.named.push_back({.body = "Ann", .stream = {}});
  config.named[0].stream.name = "lead";
  Room room(2, std::move(config));
  room.describe({person(2, "Bob"), person(3, "Cleo")});
  CHECK(room.names() == Names{"room-bob", ""});
  room.describe({person(2, "Bob"), person(3, "Cleo"), person(1, "Ann")});
  CHECK(room.names() == Names{"room-bob", "", "lead"});
}

TEST_CASE("each stream that is built is a sign of life") {
  Room room(8);
  room.describe({person(1, "Ann"), person(2, "Bob"), person(3, "Cay"), person(4, "Dee")});
  CHECK(room.adds == 4);
  CHECK(room.alive_at_adds.size() == 4);
}

TEST_CASE("bodies that come and go use up their own source's streams; named ones always return") {
  // Half of the 40 is for the room, the only source with several bodies.
  config::SourceConfig config;
  config.named.push_back({.body = "Ann", .stream = {}});
  config.named[0].stream.name = "lead";
  Room room(4, std::move(config), {}, 40);
  for (int i = 0; i < 40; ++i) {
    room.describe({person(2, "Bob", 2 + i % 2), person(1, "Ann", 2 + i % 2)});
    room.describe({});
  }
  CHECK(room.adds > 20);
  CHECK(room.adds < 50);
  CHECK(room.id_of("room-bob") == pipeline::kNoStream);
  room.describe({person(2, "Bob"), person(1, "Ann")});
  room.pass(SourceBuilder::kBetweenLateUpdates_ns);
  CHECK(room.names() == Names{"", "lead"});
  REQUIRE_FALSE(room.warnings.empty());
  CHECK_THAT(room.warnings.back(), Catch::Contains("its bodies came and went 20 times"));
}

TEST_CASE("a slot's ids come again after tens of thousands of streams, except the first") {
  StreamSlots slots(1, 1);
  const auto first = slots.next_free(true);
  REQUIRE(first);
  std::uint32_t id = *first;
  for (std::uint32_t i = 0; i < 70'000; ++i) {
    slots.give_back(id, true);
    const auto next = slots.next_free(true);
    REQUIRE(next);
    if (*next == id || *next == *first || *next == pipeline::kNoStream) FAIL("stream " << i);
    id = *next;
  }
  CHECK(pipeline::generation_of(id) > 0);
}

TEST_CASE("a body that a stage cannot serve is refused with its sentence") {
  config::SourceConfig config;
  const StageType* const generate = [] {
    for (const StageType* type : stage_types()) {
      if (type->name == "generate") return type;
    }
    return static_cast<const StageType*>(nullptr);
  }();
  REQUIRE(generate != nullptr);
  config.every.stages.push_back(
      {.type = generate, .parameters = complete_parameters(generate->parameters, {}).value()});
  Room room(2, std::move(config));
  room.describe({person(1, "Ann")});
  CHECK(room.running.empty());
  REQUIRE(room.refused.size() == 1);
  CHECK_THAT(room.refused.begin()->second, Catch::Contains("no joint angles"));
  CHECK(room.update->bodies[0].stream == pipeline::kNoStream);
  room.describe({});
  CHECK(room.refused.empty());
}

TEST_CASE("a body that comes later becomes the partner of a stream, which is built again for it") {
  config::SourceConfig config;
  config.named.push_back({.body = "Ann", .stream = merged_with("room-hand")});
  config.named[0].stream.name = "ann";
  Room room(4, std::move(config));
  room.describe({walking_person(1, "Ann")});
  const std::uint32_t alone = room.id_of("ann");
  REQUIRE(alone != pipeline::kNoStream);
  CHECK(room.settings[alone].stages[0].partners[0].stream == pipeline::kNoStream);

  room.describe({walking_person(1, "Ann"), left_hand(2, "Hand")});
  const std::uint32_t merged = room.id_of("ann");
  CHECK(merged == StreamSlots::next(alone));
  CHECK(room.settings[merged].stages[0].partners[0].stream == room.id_of("room-hand"));
  CHECK(room.update->bodies[0].stream == merged);

  // It stays as it is while the hand is away, and is built again for the hand's next stream.
  room.describe({walking_person(1, "Ann")});
  CHECK(room.id_of("ann") == merged);
  room.describe({left_hand(2, "Hand"), walking_person(1, "Ann")});
  CHECK(room.id_of("ann") == StreamSlots::next(merged));
  CHECK(room.settings[room.id_of("ann")].stages[0].partners[0].stream == room.id_of("room-hand"));
}

TEST_CASE("a device's only stream is built again for a body that comes, and others are not") {
  config::StreamConfig walker = merged_with("room-hand");
  const test::TempFolder folder;
  const auto clip = folder.path() / "walk.bvh";
  REQUIRE(clip::write_bvh(*motion::make_walker({.seconds = 0.5}), clip));
  walker.name = "walker";
  walker.driver = "file";
  walker.options =
      drivers::complete_options(*drivers::find_driver("file"), {{"path", clip.string()}}).value();
  config::StreamConfig other = walker;
  other.name = "other";
  other.stages.clear();
  Room room(2, {}, {walker, other});
  CHECK(room.id_of("walker") == 0);
  CHECK(room.id_of("other") == 1);
  room.describe({left_hand(1, "Hand")});
  CHECK(room.id_of("walker") == pipeline::stream_id(0, 1));
  CHECK(room.id_of("other") == 1);
  CHECK(room.settings[room.id_of("walker")].stages[0].partners[0].stream ==
        room.id_of("room-hand"));
}

TEST_CASE(
    "a refused body gets the model that control sets, and keeps what is set when it returns") {
  const std::string model = style::serialize_model(test::toy_model(1));
  const StageType& style = style::style_type();
  config::SourceConfig config;
  // The model of the config is for people with other joints.
  style::StyleModel other = test::toy_model(2);
  for (std::string& joint : other.space.joints) joint += "-other";
  const test::TempFolder folder;
  config.every.stages.push_back(
      {.type = &style,
       .parameters = complete_parameters(style.parameters, {}).value(),
       .model = folder.write("other.style", style::serialize_model(other))});
  Room room(2, std::move(config));
  const Skeleton toy = test::toy_skeleton();
  std::vector<std::pair<std::string, int>> joints;
  for (const Joint& joint : toy.joints) joints.emplace_back(joint.name, joint.parent);
  const BodyEntry ann = with_joints(1, "Ann", joints);
  room.describe({ann});
  CHECK(room.running.empty());
  REQUIRE(room.refused.size() == 1);

  room.kept.set_model("room-ann", style, std::as_bytes(std::span(model)), "sway.style");
  room.kept.set("room-ann", style, "alpha", 0.25);
  room.settle();
  const std::uint32_t id = room.id_of("room-ann");
  INFO((room.refused.empty() ? "" : room.refused.begin()->second));
  REQUIRE(id != pipeline::kNoStream);
  CHECK(room.settings[id].stages[0].model_name == "sway.style");
  CHECK(parameter<double>(room.settings[id].stages[0].parameters, "alpha") == 0.25);

  room.describe({});
  room.describe({ann});
  REQUIRE(room.id_of("room-ann") != pipeline::kNoStream);
  CHECK(parameter<double>(room.settings[room.id_of("room-ann")].stages[0].parameters, "alpha") ==
        0.25);
}

TEST_CASE("a model is bound once for all who come with one skeleton") {
  const StageType& style = style::style_type();
  const test::TempFolder folder;
  config::SourceConfig config;
  config.every.stages.push_back(
      {.type = &style,
       .parameters = complete_parameters(style.parameters, {}).value(),
       .model = folder.write("sway.style", style::serialize_model(test::toy_model(1)))});
  Room room(3, std::move(config));
  std::vector<std::pair<std::string, int>> joints;
  for (const Joint& joint : test::toy_skeleton().joints) {
    joints.emplace_back(joint.name, joint.parent);
  }
  const BodyEntry ann = with_joints(1, "Ann", joints), bob = with_joints(2, "Bob", joints);
  BodyEntry tall = with_joints(3, "Cay", joints);
  tall.joints[1].offset_m = {0.2F, 0.0F, 0.0F};
  room.describe({ann, bob, tall});
  REQUIRE(room.running.size() == 3);
  const auto model_of = [&](const std::string& name) {
    const auto model = room.models.at(room.id_of(name)).lock();
    REQUIRE(model);
    return model.get();
  };
  CHECK(model_of("room-ann") == model_of("room-bob"));
  CHECK(model_of("room-cay") != model_of("room-bob"));
  room.describe({bob, tall});
  CHECK(model_of("room-bob") != nullptr);
}

TEST_CASE("names of bodies are plain, short and not those of other streams") {
  CHECK(plain_stream_name("room", "Zoë Müller") == "room-zo--m-ller");
  CHECK(plain_stream_name("room", std::string(60, 'x')).size() == 28);
  BodyNames names({"room-ann"});
  CHECK(*names.name_of("room", "Ann", 1) == "room-ann-2");
  CHECK(*names.name_of("room", "Bob", 1) == "room-bob");
  CHECK(*names.name_of("room", "Bob raw", 1) == "room-bob-raw-2");  // Bob's input may have the name
  CHECK(*names.name_of("room", "Ann", 1) == "room-ann-2");
  for (int i = 0; i < 5000; ++i) static_cast<void>(names.name_of("hall", std::to_string(i), 1));
  CHECK(names.name_of("hall", "one more", 1) == nullptr);
  CHECK(names.name_of("room", "one more", 1) != nullptr);
}

}  // namespace posed::devices
