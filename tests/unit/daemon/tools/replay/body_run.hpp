// A reproducible live run of a source with several bodies, without threads and clocks: the real
// decoder, intake and engines of the template mocap system, and a device log written by hand. When
// the system describes other bodies, streams come, go and change as in the daemon.
#pragma once

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <catch2/catch.hpp>

#include "daemon/pipeline/description_row.hpp"
#include "daemon/pipeline/intake.hpp"
#include "daemon/pipeline/record_sink.hpp"
#include "daemon/pipeline/stream_engine.hpp"
#include "daemon/pipeline/stream_settings.hpp"
#include "daemon/record/decision_code.hpp"
#include "daemon/record/stream_settings.hpp"
#include "drivers/driver.hpp"
#include "drivers/mapping.hpp"
#include "drivers/template_mocap/emulator.hpp"
#include "proto/log/writer.hpp"
#include "proto/message/frame_message.hpp"

namespace posed::test {

class BodyRun final : private pipeline::IntakeOut {
 public:
  static constexpr std::uint32_t kSource = 0;

  // `mapping`: the text of the user's mapping of the joints; empty: none.
  explicit BodyRun(const std::filesystem::path& path, const std::string& mapping = {})
      : writer_(log::Writer::create(path, {}).value()),
        driver_(*drivers::find_driver("template_mocap")),
        intake_(next_item_, *this) {
    const drivers::Description device = driver_.describe("template_mocap rate=100", "udp").value();
    decoder_ = driver_.make_decoder(device).value();
    REQUIRE(writer_.add(log::SourceRow{kSource, "room", device.driver, device.text, "udp",
                                       record::to_json(drivers::Options{}, mapping)}));
    if (!mapping.empty()) mapping_ = drivers::parse_mapping(mapping, "map.toml").value();
  }

  // What the emulator sends until this time [s].
  void follow(drivers::mocap::MocapEmulator& room, double until_s) {
    while (room.next_due_ns() <= nanoseconds(until_s)) {
      std::vector<std::byte> bytes;
      const std::int64_t due_ns = room.next_due_ns();
      room.emit(due_ns, bytes);
      feed(bytes, due_ns);
    }
  }

  // One datagram. A new description takes effect after it.
  void feed(std::span<const std::byte> bytes, std::int64_t time_ns) {
    now_ns_ = kBegin_ns + time_ns;
    intake_.arrived(now_ns_);
    add_row(pipeline::Direction::kFromDevice, bytes);
    decoder_->feed_socket(0, bytes, now_ns_, intake_);
    if (described_) use(*std::exchange(described_, std::nullopt));
  }

  // The frames of these chunks never reach the engines.
  void set_shed(bool shed) { shed_ = shed; }

  void tick(double at_s) {
    now_ns_ = kBegin_ns + nanoseconds(at_s);
    for (const auto& stream : streams_) {
      if (stream->place >= 0) static_cast<void>(stream->engine->tick(now_ns_, *stream));
    }
  }

  // The daemon stops.
  void finish() {
    for (const auto& stream : streams_) {
      if (stream->place < 0) continue;
      close_gaps(*stream);
      stream->engine->flush(*stream);
    }
    REQUIRE(writer_.close());
  }

  // Ids in the log, in the order in which the streams came.
  [[nodiscard]] std::vector<std::uint32_t> ids() const {
    std::vector<std::uint32_t> ids;
    for (const auto& stream : streams_) ids.push_back(stream->id);
    return ids;
  }
  [[nodiscard]] std::uint64_t published() const { return published_; }

 private:
  static constexpr std::int64_t kBegin_ns = 5'000'000'000;

  struct Stream final : pipeline::EngineOut {
    Stream(BodyRun& owner, std::uint32_t stream_id, drivers::Body described)
        : run(owner),
          id(stream_id),
          body(std::move(described)),
          styled(body.name),
          raw(body.name + "-raw") {}
    void item(const pipeline::Item& item) noexcept override { run.publish(*this, item); }
    void decision(const pipeline::Decision& decision) noexcept override {
      pipeline::Decision placed = decision;
      placed.item = run.item_ != 0 ? run.item_ : run.next_item_;
      CHECK(run.writer_.add(record::row_of(placed)));
    }

    BodyRun& run;
    std::uint32_t id;
    drivers::Body body;
    message::FrameEncoder styled, raw;
    std::unique_ptr<pipeline::StreamEngine> engine;
    int place = -1;  // among those of the source; -1: it has left
    std::uint64_t last_frame = 0;
  };

  void add_row(pipeline::Direction direction, std::span<const std::byte> bytes) {
    std::vector<log::StreamPosition> places;
    for (const pipeline::StreamPosition& position : intake_.next().streams) {
      places.push_back({position.stream, position.frame, position.sample});
    }
    REQUIRE(writer_.add(log::ChunkRow{.source = kSource,
                                      .direction = static_cast<std::uint8_t>(direction),
                                      .arrival_ns = now_ns_,
                                      .first_item = next_item_,
                                      .places = places,
                                      .bytes = bytes}));
  }

  Stream* present(const std::string& name) {
    for (const auto& stream : streams_) {
      if (stream->place >= 0 && stream->body.name == name) return stream.get();
    }
    return nullptr;
  }

  // Each name has a slot of its own, and its numbers go on.
  Stream& come(const drivers::Body& body) {
    const auto slot = static_cast<std::uint32_t>(
        slots_.try_emplace(body.name, static_cast<std::uint32_t>(slots_.size())).first->second);
    const std::uint32_t generation = generations_[body.name]++;
    auto& stream = streams_.emplace_back(
        std::make_unique<Stream>(*this, pipeline::stream_id(slot, generation), body));
    pipeline::StreamSettings settings{.publish_raw = true, .rate_hz = 100.0};
    stream->engine = std::make_unique<pipeline::StreamEngine>(
        pipeline::engine_options(stream->id, settings, body.skeleton, {}).value());
    stream->last_frame = frames_[body.name];
    stream->engine->start_at(stream->last_frame + 1, 1);
    REQUIRE(writer_.add(log::StreamRow{stream->id, kSource, body.name, body.name,
                                       record::to_json(settings), next_item_}));
    return *stream;
  }

  void leave(Stream& stream) {
    item_ = next_item_++;
    close_gaps(stream);
    stream.engine->end(now_ns_, true, stream);
    item_ = 0;
    stream.place = -1;
    frames_[stream.body.name] = stream.last_frame;
  }

  static void close_gaps(Stream& stream) {
    stream.engine->close_gaps(stream.last_frame, 0, stream);
  }

  void use(const std::vector<std::byte>& description) {
    auto layout = driver_.make_layout(description);
    REQUIRE(layout);
    if (mapping_) static_cast<void>(drivers::use_mapping(*mapping_, **layout));
    for (const auto& stream : streams_) {
      if (stream->place < 0) continue;
      const drivers::Body* same = nullptr;
      for (const drivers::Body& body : (*layout)->bodies) {
        const bool is_same =
            body.name == stream->body.name && body.skeleton->id == stream->body.skeleton->id;
        if (is_same) same = &body;
      }
      if (same == nullptr) leave(*stream);
    }
    std::vector<std::uint32_t> ids;
    std::vector<pipeline::StreamPosition> positions;
    places_.clear();
    for (const drivers::Body& body : (*layout)->bodies) {
      Stream* stream = present(body.name);
      if (stream == nullptr) stream = &come(body);
      stream->place = static_cast<int>(places_.size());
      places_.push_back(stream);
      ids.push_back(stream->id);
      positions.push_back({.stream = stream->id, .frame = stream->last_frame + 1});
    }
    intake_.set_streams(positions);
    add_row(pipeline::Direction::kDescription, pipeline::pack_description(ids, description));
    decoder_->use(**layout);
    layout_ = std::move(*layout);
  }

  void publish(Stream& stream, const pipeline::Item& item) noexcept {
    const bool raw = item.kind == pipeline::Item::Kind::kRawFrame;
    if (!raw && item.kind != pipeline::Item::Kind::kFrame) return;
    ++published_;
    const std::string bytes =
        (raw ? stream.raw : stream.styled).encode(item.frame).SerializeAsString();
    CHECK(writer_.add(log::FrameRow{stream.id, item.frame.header.sequence, raw,
                                    std::as_bytes(std::span(bytes))}));
  }

  // IntakeOut
  bool item(std::size_t place, pipeline::Item& item) noexcept override {
    Stream& stream = *places_[place];
    if (item.kind != pipeline::Item::Kind::kFrame) return true;
    stream.last_frame = item.frame.header.sequence;
    if (shed_) return false;
    item_ = item.number;
    stream.engine->on_frame(item.frame, stream);
    item_ = 0;
    return true;
  }
  void outcome(Outcome) noexcept override {}
  void description(std::span<const std::byte> bytes) noexcept override {
    std::vector<std::byte> now(bytes.begin(), bytes.end());
    if (now != description_) described_ = description_ = std::move(now);
  }

  log::Writer writer_;
  const drivers::Driver& driver_;
  std::unique_ptr<drivers::Decoder> decoder_;
  std::optional<drivers::Mapping> mapping_;
  std::unique_ptr<const drivers::SourceLayout> layout_;
  std::uint64_t next_item_ = 1;
  pipeline::Intake intake_;
  std::vector<std::unique_ptr<Stream>> streams_;  // all that ever came
  std::vector<Stream*> places_;
  std::map<std::string, std::uint32_t> slots_, generations_;
  std::map<std::string, std::uint64_t> frames_;  // how many a name had when it left
  std::vector<std::byte> description_;
  std::optional<std::vector<std::byte>> described_;
  std::int64_t now_ns_ = kBegin_ns;
  std::uint64_t item_ = 0;  // number of the item in an engine; 0 between items
  std::uint64_t published_ = 0;
  bool shed_ = false;
};

// Two people for five seconds: the waver leaves after the first, comes back after the second and
// leaves again after the fourth, when the walker comes back with other joints. From 1.3 s to 1.4 s
// frames are shed, and in the fourth second nothing comes. Returns the ids of the streams as they
// come: walker, waver, waver again, walker again.
inline std::vector<std::uint32_t> write_body_log(const std::filesystem::path& path) {
  BodyRun run(path);
  drivers::mocap::MocapEmulator room(100.0);
  run.follow(room, 1.0);
  room.set_present(1, false);
  run.follow(room, 1.3);
  run.set_shed(true);
  run.follow(room, 1.4);
  run.set_shed(false);
  run.follow(room, 2.0);
  room.set_present(1, true);
  run.follow(room, 3.0);
  run.tick(3.6);
  drivers::mocap::BodyEntry walker{
      .id = 1, .name = "Walker", .joints = {{"hips", -1, {0.0F, 0.95F, 0.0F}}}};
  for (const char* name : {"spine", "chest", "neck", "head"}) {
    walker.joints.push_back(
        {name, static_cast<int>(walker.joints.size()) - 1, {0.0F, 0.15F, 0.0F}});
  }
  run.feed(drivers::mocap::encode_description(std::span(&walker, 1)), nanoseconds(4.0));
  for (std::uint32_t i = 0; i < 100; ++i) {
    drivers::mocap::BodyPose pose{
        .id = 1, .root_m = {0.01F * static_cast<float>(i), 0.95F, 0.0F}, .rotation_xyzw = {}};
    const float turn = 0.01F * static_cast<float>(i);
    pose.rotation_xyzw.assign(walker.joints.size(), {turn, 0.0F, 0.0F, std::sqrt(1 - turn * turn)});
    const drivers::mocap::FramePacket packet{
        .number = 1000 + i, .time_us = 4'000'000 + i * 10'000, .bodies = {pose}};
    run.feed(drivers::mocap::encode_frame(packet), nanoseconds(4.0 + 0.01 * i));
  }
  run.finish();
  return run.ids();
}

}  // namespace posed::test
