#include "daemon/publish/published_stream.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>

#include "daemon/publish/frame_output.hpp"
#include "models/stage_type.hpp"
#include "proto/message/frame_message.hpp"
#include "proto/message/skeleton_message.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/parameter.hpp"
#include "proto/text/stream_name.hpp"

namespace posed::publish {
namespace {

v1::Percentiles percentiles(LatencyHistogram& histogram) {
  v1::Percentiles message;
  message.set_p50_us(static_cast<float>(histogram.percentile_us(0.5)));
  message.set_p99_us(static_cast<float>(histogram.percentile_us(0.99)));
  message.set_max_us(static_cast<float>(histogram.max_us()));
  histogram.clear();
  return message;
}

// A stage that did not process the frame has set no stamp.
void add_between(LatencyHistogram& second, DurationBuckets& all, std::int64_t from_ns,
                 std::int64_t to_ns) noexcept {
  if (from_ns == kNoTime_ns || to_ns == kNoTime_ns) return;
  second.add(to_ns - from_ns);
  all.add(to_ns - from_ns);
}

// Only of a glove, because the device info of a file is its whole header.
void describe_device(const drivers::Description& device, v1::StreamStats& stats) {
  const drivers::Driver* driver = drivers::find_driver(device.driver);
  stats.set_identity(clean(device.identity));
  if (driver != nullptr && driver->glove != nullptr) stats.set_device_info(device.text);
}

void fill_text(const ParameterSpec& spec, const StageInfo& info, v1::StageStats& stage) {
  const auto text = info.texts.find(spec.name);
  if (text == info.texts.end()) return;
  v1::ParameterStats& parameter = *stage.add_parameter();
  parameter.set_name(std::string(spec.shown_name()));
  parameter.set_text(clean(text->second));
}

// The stages' names, models and live parameters; the times of the last report stay.
void fill_stages(const std::vector<StageInfo>& stages, const pipeline::PipelineCounters& counters,
                 v1::StreamStats& stats) {
  std::size_t live = 0;
  for (std::size_t i = 0; i < stages.size(); ++i) {
    const bool known = static_cast<int>(i) < stats.stage_size();
    v1::StageStats& stage = known ? *stats.mutable_stage(static_cast<int>(i)) : *stats.add_stage();
    stage.set_name(std::string(stages[i].type->name));
    stage.set_model(clean(stages[i].model));
    if (stats.model().empty()) stats.set_model(stage.model());
    stage.clear_word();
    for (const std::string& word : stages[i].words) stage.add_word(clean(word));
    stage.clear_parameter();
    for (const ParameterSpec& spec : stages[i].type->parameters) {
      if (!spec.live) continue;
      if (!has_number(spec)) {
        fill_text(spec, stages[i], stage);
        continue;
      }
      const pipeline::ParameterCounter& counter = counters.parameter[live++];
      v1::ParameterStats& parameter = *stage.add_parameter();
      parameter.set_name(std::string(spec.shown_name()));
      parameter.set_value(counter.now.load() * spec.display_scale);
      parameter.set_target(counter.target.load() * spec.display_scale);
      if (spec.name != "alpha") continue;
      stats.set_alpha(static_cast<float>(parameter.value()));
      stats.set_alpha_target(static_cast<float>(parameter.target()));
    }
  }
}

// Each reading into the field that has its name, where it is known. A reading whose field is a text
// is the index of a joint.
void fill_readings(const StreamInfo& info, v1::StreamStats& stats) {
  using google::protobuf::FieldDescriptor;
  const auto* reflection = v1::StreamStats::GetReflection();
  std::size_t next = 0;
  for (const StageInfo& stage : info.stages) {
    for (const StageReadingType& reading : stage.type->readings) {
      const auto* field = v1::StreamStats::descriptor()->FindFieldByName(std::string(reading.name));
      const double value = info.counters->pipeline.reading[next++].now.load();
      reflection->ClearField(&stats, field);
      if (std::isnan(value)) continue;
      if (field->cpp_type() == FieldDescriptor::CPPTYPE_FLOAT) {
        reflection->SetFloat(&stats, field, static_cast<float>(value));
        continue;
      }
      const auto number = static_cast<std::uint64_t>(value);
      if (field->cpp_type() == FieldDescriptor::CPPTYPE_UINT64) {
        reflection->SetUInt64(&stats, field, number);
        continue;
      }
      const auto& skeleton = reading.of_leaving ? info.skeleton : info.description.skeleton;
      if (skeleton != nullptr && number < skeleton->joints.size()) {
        reflection->SetString(&stats, field, clean(skeleton->joints[number].name));
      }
    }
  }
}

constexpr double kLossy_s = 10.0;  // after its last loss, as posed.proto says
constexpr std::array<const char*, 4> kStateNames{"waiting", "live", "stale", "ended"};

}  // namespace

std::vector<StageInfo> stage_infos(const pipeline::StreamSettings& settings) {
  std::vector<StageInfo> infos;
  for (const pipeline::StageSettings& stage : settings.stages) {
    StageInfo& info = infos.emplace_back(
        StageInfo{.type = stage.type, .model = stage.model_name, .words = stage.model_words});
    for (const ParameterSpec& spec : stage.type->parameters) {
      if (!text_command(*stage.type, spec)) continue;
      info.texts.emplace(spec.name,
                         parameter<std::string>(stage.parameters, std::string(spec.name)));
    }
  }
  return infos;
}

Channel::Channel(const std::string& name, const StreamInfo& info, bool unstyled)
    : pose_topic("pose/" + name),
      skeleton_topic("skeleton/" + name),
      sensor_topic("sensor/" + name),
      event_topic("event/" + name),
      frames(name),
      samples(name, info.description.samples) {
  if (const auto& of = unstyled ? info.description.skeleton : info.skeleton) {
    skeleton = message::skeleton_message(name, *of, info.rate_hz);
    if (!unstyled) {
      for (const StageInfo& stage : info.stages) {
        skeleton->add_stage(std::string(stage.type->name));
      }
    }
  }
}

PublishedStream::PublishedStream(StreamInfo stream_info)
    : info(std::move(stream_info)), styled(info.name, info, false) {
  if (info.raw) raw.emplace(raw_name(info.name), info, true);
  now_.stages = info.stages;
  if (!info.refusal.empty()) styled.skeleton.reset();  // no pose will ever need it
}

void PublishedStream::measure(const Frame& frame, const StageStamps& stamps) noexcept {
  if (frame.quality == Quality::kStale) return;
  const std::int64_t arrival_ns = frame.header.arrival_ns;
  add_between(decode_, all_decode_, arrival_ns, stamps.decoded_ns);
  if (stamps.decoded_ns == kNoTime_ns) return;  // computed by a replay, which is not timed
  float all_us = 0.0F;
  for (std::size_t i = 0; i < info.stages.size(); ++i) {
    const std::int64_t took_ns = nanoseconds(frame.stage_us[i] * 1e-6);
    stage_[i].add(took_ns);
    all_stage_[i].add(took_ns);
    all_us += frame.stage_us[i];
  }
  if (!info.stages.empty()) stages_.add(nanoseconds(all_us * 1e-6));
  add_between(publish_, all_publish_, arrival_ns, stamps.published_ns);
}

void PublishedStream::count(const Frame& frame, const StageStamps& stamps) {
  measure(frame, stamps);
  const std::scoped_lock lock(mutex_);
  ++now_.published.frames;
  ++now_.by_quality[static_cast<std::size_t>(frame.quality)];
  now_.lag_frames = frame.lag_frames;
  now_.lag_ms = frame.lag_ms;
  now_.label = frame.label;
  now_.label_probability = frame.label_probability;
  now_.source = frame.source;
  now_.clock = frame.header.clock;
}

void PublishedStream::count_sample() {
  const std::scoped_lock lock(mutex_);
  ++now_.published.samples;
}

void PublishedStream::count_silence() {
  const std::scoped_lock lock(mutex_);
  ++now_.silences;
}

void PublishedStream::leave_outputs() noexcept {
  for (FrameOutput* const output : outputs) output->stream_leaves(info.stream);
  outputs.clear();
}

void PublishedStream::set_stages(std::vector<StageInfo> stages) {
  const std::scoped_lock lock(mutex_);
  now_.stages = std::move(stages);
}

// Before the reader has started, no device counts as absent.
bool is_away(const pipeline::SourceCounters& source, bool comes_and_goes) noexcept {
  return comes_and_goes && source.link_ns.load() != kNoTime_ns && !source.connected.load();
}

void PublishedStream::fill_device(v1::StreamStats& stats) const {
  const pipeline::SourceCounters& source = *info.source_counters;
  stats.clear_outcome();
  for (const auto& outcome : source.outcome) stats.add_outcome(outcome.load());
  stats.set_kernel_dropped(source.kernel_dropped.load());
  const std::int64_t link_ns = source.link_ns.load();
  stats.set_away(is_away(source, info.comes_and_goes));
  stats.set_connections(source.connections.load());
  stats.set_link_ns(link_ns != kNoTime_ns ? link_ns : 0);
  if (info.present) describe_device(*info.present->description(), stats);
}

void PublishedStream::fill(v1::StreamStats& stats) const {
  const auto& pipeline = info.counters->pipeline;
  stats.set_stream(info.name);
  stats.set_driver(info.description.driver);
  stats.set_source_name(info.source);
  stats.set_body(clean(info.body));
  stats.set_refusal(clean(info.refusal));
  stats.set_state(info.refusal.empty()
                      ? kStateNames[static_cast<std::size_t>(pipeline.state.load())]
                      : "refused");
  stats.set_dropped(info.counters->reader.dropped.load() + pipeline.dropped.load());
  stats.set_shed(pipeline.shed.load());
  fill_readings(info, stats);
  fill_device(stats);
  const std::scoped_lock lock(mutex_);
  stats.set_frames(now_.published.frames);
  stats.set_samples(now_.published.samples);
  stats.clear_model();
  fill_stages(now_.stages, pipeline, stats);
  stats.set_lag_frames(now_.lag_frames);
  stats.set_lag_ms(now_.lag_ms);
  // A hand that is not there makes no gesture; one that performs needs no device.
  const bool comes = pipeline.state.load() == pipeline::StreamState::kLive && !stats.away();
  const bool labelled = comes || now_.source == Source::kLabels;
  const auto end = labelled ? std::ranges::find(now_.label, '\0') : now_.label.begin();
  stats.set_label(std::string(now_.label.begin(), end));
  stats.set_label_probability(labelled ? now_.label_probability : 0.0F);
  stats.set_source(static_cast<v1::Source>(now_.source));
  if (now_.clock.valid) stats.set_clock_offset_ns(now_.clock.offset_ns);
  stats.set_clock_drift_ppm(now_.clock.drift_ppm);
}

PublishedStream::Counts PublishedStream::counts() const {
  const std::scoped_lock lock(mutex_);
  return now_.published;
}

StreamFigures PublishedStream::figures() const {
  StreamFigures figures{
      .stream = info.name, .rate_hz = info.rate_hz, .decoded = info.counters->reader.frames.load()};
  {
    const std::scoped_lock lock(mutex_);
    figures.published = now_.by_quality;
    figures.silences = now_.silences;
  }
  figures.decode = all_decode_.counts();
  figures.publish = all_publish_.counts();
  for (std::size_t i = 0; i < info.stages.size(); ++i) {
    figures.stages.emplace_back(info.stages[i].type->name, all_stage_[i].counts());
  }
  return figures;
}

v1::StreamStats PublishedStream::stats() const {
  v1::StreamStats stats;
  {
    const std::scoped_lock lock(mutex_);
    stats = reported_;
  }
  fill(stats);
  return stats;
}

v1::StreamStats PublishedStream::report(double seconds_since) {
  v1::StreamStats stats;
  fill(stats);
  const auto frames = static_cast<double>(stats.frames() - frames_reported_);
  stats.set_rate_hz(seconds_since > 0.0 ? static_cast<float>(frames / seconds_since) : 0.0F);
  frames_reported_ = stats.frames();
  const std::uint64_t lost = stats.dropped() + stats.shed() + stats.kernel_dropped();
  lossy_for_s_ = lost > lost_reported_ ? kLossy_s : lossy_for_s_ - seconds_since;
  lost_reported_ = lost;
  stats.set_lossy(lossy_for_s_ > 0.0);
  *stats.mutable_decode() = percentiles(decode_);
  *stats.mutable_stages() = percentiles(stages_);
  for (std::size_t i = 0; i < info.stages.size(); ++i) {
    *stats.mutable_stage(static_cast<int>(i))->mutable_time() = percentiles(stage_[i]);
  }
  *stats.mutable_publish() = percentiles(publish_);
  const std::scoped_lock lock(mutex_);
  reported_ = stats;
  return stats;
}

SampleEncoder::SampleEncoder(const std::string& stream, const drivers::SampleLayout& layout) {
  message_.set_stream(stream);
  for (const std::string& name : layout.names) message_.add_name(name);
  for (const std::string& unit : layout.units) message_.add_unit(unit);
}

const v1::Sample& SampleEncoder::encode(const Sample& sample) {
  message_.set_sequence(sample.header.sequence);
  if (sample.header.device_ns != kNoTime_ns) {
    message_.set_device_ns(sample.header.device_ns);
  } else {
    message_.clear_device_ns();
  }
  message_.set_arrival_ns(sample.header.arrival_ns);
  message::assign(*message_.mutable_value(), {sample.value.data(), sample.value_count});
  message::assign_flags(*message_.mutable_validity(), sample.valid, sample.value_count);
  message_.set_quality(static_cast<v1::Quality>(sample.quality));
  return message_;
}

}  // namespace posed::publish
