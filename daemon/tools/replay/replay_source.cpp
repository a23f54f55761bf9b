#include "daemon/tools/replay/replay_source.hpp"

#include <algorithm>
#include <utility>

#include "daemon/pipeline/description_row.hpp"
#include "daemon/pipeline/record_sink.hpp"
#include "drivers/glove/calibrated_decoder.hpp"
#include "proto/frame/same_skeleton.hpp"
#include "proto/log/digest.hpp"
#include "proto/log/reader.hpp"
#include "proto/text/clean.hpp"

namespace posed::replay {
namespace {

using pipeline::StreamPosition;

constexpr std::size_t kKeptLayouts = 32;  // kept for another use

std::string text_of(const log::ChunkRow& chunk) {
  return {reinterpret_cast<const char*>(chunk.bytes.data()), chunk.bytes.size()};
}

}  // namespace

ReplaySource::ReplaySource(const drivers::Driver& driver, const log::SourceRow& source,
                           std::vector<ReplayStreamContext*> streams, ReplayHost& host,
                           std::string file)
    : driver_(driver),
      source_(source),
      streams_(std::move(streams)),
      host_(host),
      file_(std::move(file)),
      intake_(host.next_item, *this) {}

Result<std::unique_ptr<ReplaySource>> ReplaySource::open(const log::SourceRow& source,
                                                         std::vector<ReplayStreamContext*> streams,
                                                         ReplayHost& host,
                                                         const std::string& file) {
  const drivers::Driver* driver = drivers::find_driver(source.driver);
  if (driver == nullptr) {
    return fail("source " + in_quotes(source.name) + " comes from driver " +
                    in_quotes(source.driver) + ", which this posed does not have; update posed",
                file);
  }
  auto self = std::make_unique<ReplaySource>(*driver, source, std::move(streams), host, file);
  TRY(self->open_device());
  return self;
}

Result<> ReplaySource::open_device() {
  auto description = TRY(driver_.describe(source_.text, source_.identity));
  auto decoder = TRY(driver_.make_decoder(description));
  device_ = std::move(description);
  decoder_ = std::move(decoder);
  if (has_several()) return open_mapping();
  // Its stream may have been built several times, in one slot.
  const auto is_other = [this](const ReplayStreamContext* stream) {
    return pipeline::slot_of(stream->log_id()) != pipeline::slot_of(streams_[0]->log_id());
  };
  if (std::ranges::any_of(streams_, is_other)) {
    return fail("the log is damaged (source " + in_quotes(source_.name) +
                    " has several bodies, but devices of driver " + in_quotes(driver_.name) +
                    " have one); use another copy of it",
                file_);
  }
  only_.skeleton = device_.skeleton;
  only_.samples = device_.samples;
  only_.rate_hz = device_.rate_hz;
  places_ = {streams_[0]};
  const StreamPosition begin{.stream = places_[0]->index()};
  intake_.set_streams(std::span(&begin, 1));
  return places_[0]->describe(device_, false);
}

Result<> ReplaySource::open_mapping() {
  auto text = TRY(record::mapping_from_json(source_.config, file_));
  if (!text.empty()) mapping_ = TRY(drivers::parse_mapping(std::move(text), file_));
  return {};
}

ReplayStreamContext* ReplaySource::find(std::uint32_t log_id) const {
  const auto found = std::ranges::lower_bound(streams_, log_id, {}, &ReplayStreamContext::log_id);
  return found == streams_.end() || (*found)->log_id() != log_id ? nullptr : *found;
}

std::unexpected<Error> ReplaySource::impossible(const log::ChunkRow& chunk) const {
  return log::damaged_row(file_, "chunk", chunk.id, "has an impossible time or place");
}

Result<std::shared_ptr<const drivers::SourceLayout>> ReplaySource::layout_of(
    std::span<const std::byte> description) {
  std::string hash = log::sha256_hex(description);
  if (const auto known = layouts_.find(hash); known != layouts_.end()) return known->second;
  auto made = TRY(driver_.make_layout(description));
  // The live run has said what does not fit.
  if (mapping_) static_cast<void>(drivers::use_mapping(*mapping_, *made));
  if (layouts_.size() == kKeptLayouts) layouts_.clear();
  return layouts_.emplace(std::move(hash), std::move(made)).first->second;
}

// Checks everything that a description row says.
Result<ReplaySource::Bodies> ReplaySource::bodies_of(const log::ChunkRow& row) {
  const auto damaged = [&](const std::string& how) {
    return log::damaged_row(file_, "chunk", row.id, how);
  };
  const auto unpacked = pipeline::unpack_description(row.bytes);
  // That of a device with one body says only which stream the body has from there on.
  if (!has_several() && (!unpacked || !unpacked->description.empty())) {
    return damaged("describes bodies, but devices of driver " + in_quotes(driver_.name) +
                   " have one");
  }
  if (!unpacked) return damaged("has a description that is cut short");
  Bodies bodies;
  if (has_several()) {
    auto layout = layout_of(unpacked->description);
    if (!layout) {
      return damaged("has a description that cannot be read (" + layout.error().message + ")");
    }
    bodies.layout = std::move(*layout);
  }
  const std::span<const drivers::Body> described = bodies_in(bodies.layout);
  if (described.size() != unpacked->streams.size()) {
    return damaged("describes " + std::to_string(described.size()) +
                   " bodies, but names streams for " + std::to_string(unpacked->streams.size()));
  }
  std::vector<std::uint32_t> named;
  for (const std::uint32_t id : unpacked->streams) {
    bodies.streams.push_back(id == pipeline::kNoStream ? nullptr : find(id));
    if (id == pipeline::kNoStream) continue;
    const std::string stream = "stream " + std::to_string(id);
    const ReplayStreamContext* const known = bodies.streams.back();
    if (known == nullptr) return damaged("describes " + stream + ", which its source lacks");
    if (std::ranges::count(named, id) > 0) return damaged("describes " + stream + " twice");
    const auto& body = described[bodies.streams.size() - 1];
    // The engine is built for the body as it was first described.
    if (known->stream().described &&
        !same_skeleton(known->stream().description.skeleton.get(), body.skeleton.get())) {
      return damaged("describes " + stream + " with another skeleton than before");
    }
    named.push_back(id);
  }
  const bool same =
      std::ranges::equal(row.places, named, {}, &log::StreamPosition::stream) &&
      std::ranges::all_of(row.places, [](const auto& place) { return place.next_frame != 0; });
  if (!same || !is_possible_time(row.arrival_ns)) return impossible(row);
  return bodies;
}

// The rate is the one to which the live run bound the models.
Result<> ReplaySource::expect(const log::ChunkRow& row) {
  const auto bodies = TRY(bodies_of(row));
  const bool at_once = !std::exchange(described_, true);
  for (std::size_t i = 0; i < bodies.streams.size(); ++i) {
    ReplayStreamContext* const stream = bodies.streams[i];
    if (stream == nullptr || stream->stream().described) continue;
    const drivers::Body& body = bodies_in(bodies.layout)[i];
    drivers::Description description = device_;
    description.skeleton = body.skeleton;
    description.samples = body.samples;
    description.rate_hz = stream->stream().settings.rate_hz;
    // The bodies of the first description come at once; the engine of a later one would wait long,
    // and there may be thousands.
    TRY(stream->describe(std::move(description), !at_once));
  }
  return {};
}

void ReplaySource::set_gap(std::int64_t after_chunk) {
  gap_after_ = std::min(gap_after_.value_or(after_chunk), after_chunk);
}

StreamPosition ReplaySource::position(const ReplayStreamContext& stream,
                                      const log::StreamPosition& place) const {
  StreamPosition position{.stream = stream.index(), .frame = place.next_frame};
  const std::uint64_t next = next_sample(position.stream);
  if (next != 0) position.sample = next;
  if (place.next_sample != 0) position.sample = place.next_sample;
  return position;
}

std::uint64_t ReplaySource::next_sample(std::uint32_t stream) const noexcept {
  for (const StreamPosition& now : intake_.next().streams) {
    if (now.stream == stream) return now.sample;
  }
  return 0;
}

void ReplaySource::arrived(const log::ChunkRow& chunk, std::span<const StreamPosition> positions) {
  const std::uint64_t next = intake_.next().item;
  intake_.go_to({.item = chunk.first_item != 0 ? chunk.first_item : next, .streams = positions});
  arrival_ns_ = chunk.arrival_ns;
  intake_.arrived(arrival_ns_);
}

Result<> ReplaySource::find_place(const log::ChunkRow& chunk) {
  if (!is_possible_time(chunk.arrival_ns)) return impossible(chunk);
  positions_.clear();
  for (const log::StreamPosition& place : chunk.places) {
    const ReplayStreamContext* const stream = find(place.stream);
    if (stream == nullptr || place.next_frame == 0) return impossible(chunk);
    positions_.push_back(position(*stream, place));
  }
  const bool same = std::ranges::equal(positions_, intake_.next().streams, {},
                                       &StreamPosition::stream, &StreamPosition::stream);
  // A gap may hide the row by which the bodies changed.
  const bool changes = has_several() || streams_.size() > 1;
  const bool excused = changes && gap_after_ && chunk.id > *gap_after_;
  if (!same && !excused) return impossible(chunk);
  arrived(chunk, positions_);
  return {};
}

// Swaps the bodies as the live reader does. The ends of those who leave were decided at items
// before this row; what was decided at the next item may be for those who come.
Result<> ReplaySource::use_bodies(const log::ChunkRow& row) {
  const auto bodies = TRY(bodies_of(row));
  if (row.first_item > 0) host_.reach(row.first_item - 1);
  for (ReplayStreamContext* const stream : places_) {
    if (std::ranges::count(bodies.streams, stream) == 0) stream->leave(row.arrival_ns);
  }
  const std::vector<ReplayStreamContext*> before = std::exchange(places_, {});
  positions_.clear();
  auto place = row.places.begin();
  for (ReplayStreamContext* const stream : bodies.streams) {
    if (stream == nullptr) {
      positions_.push_back({.stream = pipeline::kNoStream});
      continue;
    }
    places_.push_back(stream);
    positions_.push_back(position(*stream, *place++));
    if (std::ranges::count(before, stream) == 0) stream->begin(positions_.back());
  }
  intake_.set_streams(positions_);
  arrived(row, {});
  if (bodies.layout) decoder_->use(*bodies.layout);
  layout_ = bodies.layout;
  return {};
}

Result<> ReplaySource::feed(const log::ChunkRow& chunk) {
  const auto direction = static_cast<pipeline::Direction>(chunk.direction);
  if (direction == pipeline::Direction::kDescription) return use_bodies(chunk);
  TRY(find_place(chunk));
  switch (direction) {
    case pipeline::Direction::kFromDevice:
      decoder_->feed_socket(static_cast<std::uint8_t>(chunk.socket), chunk.bytes, arrival_ns_,
                            intake_);
      return {};
    case pipeline::Direction::kToDevice:
      return {};
    case pipeline::Direction::kDeviceInfo:
      return use_device(text_of(chunk));
    case pipeline::Direction::kCalibration:
      return calibrate(text_of(chunk));
    default:
      return log::damaged_row(file_, "chunk", chunk.id,
                              "has an unknown kind, or comes from a newer posed");
  }
}

// The device came back, perhaps with other properties; what the pipeline was bound to stays.
Result<> ReplaySource::use_device(const std::string& info) {
  auto description = TRY(driver_.describe(info, source_.identity));
  decoder_ = TRY(driver_.make_decoder(description));
  device_ = std::move(description);
  intake_.new_link();
  if (calibration_) use_calibration();
  if (layout_) decoder_->use(*layout_);
  return {};
}

Result<> ReplaySource::calibrate(const std::string& toml) {
  drivers::Description device = device_;
  device.identity.clear();  // the live run has checked to which device it belongs
  calibration_ = TRY(devices::compile_calibration(device, toml, "the log's calibration"));
  use_calibration();
  return {};
}

void ReplaySource::use_calibration() {
  auto* const glove = drivers::glove::calibrated_decoder(*decoder_);
  if (glove != nullptr) glove->calibrate(*calibration_->calibration);
}

bool ReplaySource::item(std::size_t place, pipeline::Item& item) noexcept {
  places_[place]->handle(item);
  return true;
}

}  // namespace posed::replay
