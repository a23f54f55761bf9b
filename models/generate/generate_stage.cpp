#include "models/generate/generate_stage.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "models/gesture/model_file.hpp"
#include "models/gesture/play_order.hpp"
#include "models/parameter_table.hpp"
#include "posed/v1/log.pb.h"
#include "posed/v1/model.pb.h"
#include "proto/frame/degree.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/text/clean.hpp"

namespace posed::generate {
namespace {

// Silence after which frames that wait go out: longer than a frame that is only late.
constexpr std::int64_t kSilence_ns = 100'000'000;
constexpr std::int64_t kSilentFrames = 4;
constexpr double kMaxStep_s = 0.1;  // of the heading: a frame of the slowest stream

}  // namespace

GenerateStage::GenerateStage(std::shared_ptr<const Skeleton> skeleton,
                             const smooth::LiveOptions& options, double rate_hz,
                             const BoundModel* model)
    : skeleton_(std::move(skeleton)),
      smoother_(*skeleton_, options, model != nullptr ? model->live.get() : nullptr),
      player_(rate_hz, gesture::most_channels(*skeleton_)),
      model_(model),
      period_ns_(nanoseconds(1.0 / rate_hz)),
      live_(gesture::most_channels(*skeleton_)),
      read_(live_.size()) {
  if (hand_side(*skeleton_)) {
    hand_ = gesture::PoseChannels::of_hand(*skeleton_);
  } else {
    standing_.emplace(*skeleton_);
  }
  player_.set_model(model);
  use_channels();
}

RT_SAFE void GenerateStage::use_channels() noexcept {
  if (hand_) {
    pose_channels_ = &*hand_;
  } else {
    pose_channels_ = model_ != nullptr ? &*model_->live->body : nullptr;
  }
}

// A body that performs could not be led back without the model, whose channels it has.
RT_SAFE bool GenerateStage::use(const StageModel* model) noexcept {
  if (model == nullptr && !hand_ && performs()) return false;
  model_ = static_cast<const BoundModel*>(model);
  static_cast<void>(smoother_.set_model(model_ != nullptr ? model_->live.get() : nullptr));
  player_.set_model(model_);
  use_channels();
  if (pose_channels_ == nullptr || hand_ || !has_last_) return true;
  // The channels of a body are those of its model.
  std::ranges::fill(live_, 0.0);
  follow(last_);
  player_.go_on_from(used(live_));
  return true;
}

RT_SAFE bool GenerateStage::command(std::size_t index, const StageCommand& command) noexcept {
  if (index == kPlay) return player_.play(command.as<gesture::PlayOrder>());
  player_.stop();
  return true;
}

RT_SAFE void GenerateStage::describe(std::size_t index, const StageCommand& command,
                                     ShortText& text) const noexcept {
  if (index != kPlay || model_ == nullptr) return;
  const auto& labels = model_->gesture().labels;
  const auto order = command.as<gesture::PlayOrder>();
  for (const std::uint16_t label : order.labels()) {
    if (label >= labels.size() || text.cut()) return;
    if (!text.text().empty()) text.add(" ");
    text.add(labels[label].name);
  }
}

class GenerateStage::Smoothed final : public StageOut {
 public:
  Smoothed(GenerateStage& stage, StageOut& out) noexcept : stage_(stage), out_(out) {}
  void frame(const StageFrame& frame) noexcept override { stage_.smoothed(frame, out_); }

 private:
  GenerateStage& stage_;
  StageOut& out_;
};

RT_SAFE void GenerateStage::process(const StageFrame& in, StageOut& out) noexcept {
  Smoothed smoothed(*this, out);
  if (in.frame.skeleton != skeleton_->id) {
    smoother_.flush(smoothed);
    out.frame({.frame = in.frame});  // not this stage's body
  } else if (in.frame.source == Source::kLabels) {
    rest(in, out);
  } else {
    ++entered_;
    smoother_.process(in, smoothed);
  }
}

RT_SAFE void GenerateStage::received(std::int64_t arrival_ns) noexcept {
  last_received_ns_ = arrival_ns;
  last_tick_ns_ = kNoTime_ns;
}

RT_SAFE std::int64_t GenerateStage::next_due_ns() const noexcept {
  const bool waiting = entered_ != 0 || performs();
  if (!waiting || last_received_ns_ == kNoTime_ns) return kNoTime_ns;
  if (last_tick_ns_ != kNoTime_ns) return last_tick_ns_ + period_ns_;
  return last_received_ns_ + std::max(kSilence_ns, kSilentFrames * period_ns_);
}

RT_SAFE void GenerateStage::tick(std::int64_t now_ns, StageOut& out) noexcept {
  last_tick_ns_ = now_ns;
  flush(out);
  if (!performs() || !has_last_) return;
  // The last frame again, as it would have come by now.
  Header& header = last_.header;
  if (header.device_ns != kNoTime_ns) header.device_ns += now_ns - header.arrival_ns;
  header.arrival_ns = now_ns;
  const bool only_performs = last_.source == Source::kLabels && !live_seen_;
  show(last_, only_performs ? std::span<const double>() : used(live_), out);
}

RT_SAFE void GenerateStage::flush(StageOut& out) noexcept {
  Smoothed smoothed(*this, out);
  smoother_.flush(smoothed);
}

// A frame comes out of the smoother.
RT_SAFE void GenerateStage::smoothed(const StageFrame& in, StageOut& out) noexcept {
  entered_ = std::max(entered_ - 1, 0);
  channels_ = std::min(in.variance_rad2.size(), variance_rad2_.size());
  std::copy_n(in.variance_rad2.begin(), channels_, variance_rad2_.begin());
  if (pose_channels_ == nullptr) {
    return out.frame({.frame = in.frame, .variance_rad2 = variance_rad2()});
  }
  live_seen_ = true;
  last_ = in.frame;
  has_last_ = true;
  follow(last_);
  show(last_, used(live_), out);
}

// A frame of a stream that only performs: a hand at rest, or a body as it stands.
RT_SAFE void GenerateStage::rest(const StageFrame& in, StageOut& out) noexcept {
  if (pose_channels_ == nullptr) return out.frame(in);
  const bool first = !std::exchange(has_last_, true);
  last_ = in.frame;
  if (!hand_ && first) {
    follow(last_);
    player_.go_on_from(used(live_));
  }
  show(last_, {}, out);
}

// Reads the live pose from a frame; what it did not measure stays.
RT_SAFE void GenerateStage::follow(const Frame& frame) noexcept {
  const double dt_s = std::min(elapsed_.next_s(frame.header), kMaxStep_s);
  if (pose_channels_->has_heading(frame)) {
    static_cast<void>(heading_.update(pose_channels_->heading_rad(frame), dt_s));
  }
  const std::span<double> read = used(read_);
  pose_channels_->read(frame, heading_.value_rad(), read);
  pose_channels_->unwrap(used(live_), read);
  for (std::size_t c = 0; c < read.size(); ++c) {
    if (std::isfinite(read[c])) live_[c] = read[c];
  }
}

// What the player makes of the frame goes out.
RT_SAFE void GenerateStage::show(Frame& frame, std::span<const double> live,
                                 StageOut& out) noexcept {
  const GesturePlayer::Pose shown = player_.step(live);
  if (shown.what != GesturePlayer::What::kLive) pose(shown, frame);
  if (shown.what == GesturePlayer::What::kPerformed) {
    const std::string& name = model_->gesture().labels[shown.label].name;
    std::copy_n(name.begin(), std::min(name.size(), frame.label.size() - 1), frame.label.begin());
    frame.label_probability = 1.0F;
    const std::size_t all = frame.angle_count;
    if (channels_ < all) {  // the smoother did not see this frame: it is exact but for these
      std::fill(variance_rad2_.begin(), variance_rad2_.begin() + frame.angle_count, 0.0);
      channels_ = all;
    }
    pose_channels_->spread(shown.variance_rad2, std::span(variance_rad2_).first(channels_));
  }
  out.frame({.frame = frame, .variance_rad2 = variance_rad2()});
}

// A body stays where its feet are: the model knows no place of the root.
RT_SAFE void GenerateStage::pose(const GesturePlayer::Pose& shown, Frame& frame) noexcept {
  if (standing_) {
    const perform::Standing::Feet places_m = standing_->feet_m(frame);
    pose_channels_->write(shown.angles, heading_.value_rad(), frame);
    static_cast<void>(standing_->stand(places_m, frame));
  } else {
    pose_channels_->write(shown.angles, 0.0, frame);
  }
  frame.source = Source::kLabels;
  frame.quality = shown.what == GesturePlayer::What::kHeld ? Quality::kHeld : Quality::kMeasured;
  frame.label.fill('\0');
  frame.label_probability = 0.0F;
}

namespace {

using gesture::PlayOrder;

// Above 60 Hz the lag is limited as a time; at no frame rate is that time longer than this many
// frames.
constexpr double kMaxLagFrames = 170.0;
constexpr double kMaxNoise_rad = 90.0 * kDegree;

const gesture::GestureModel* gesture_of(const StageModel* model) {
  return model == nullptr ? nullptr : &static_cast<const BoundModel*>(model)->gesture();
}

bool takes(const v1::ModelFile& file) { return file.has_gesture(); }

Result<std::unique_ptr<const StageModel>> bind(std::span<const std::byte> file,
                                               const StageContext& context,
                                               const std::string& name) {
  auto model = TRY(gesture::parse_model(file, name));
  return bind_model(std::move(model), *context.skeleton, context.rate_hz, name);
}

std::optional<ParameterFault> check(const Parameters& parameters, bool has_model) {
  const auto labels = gesture::split_labels(parameter<std::string>(parameters, "labels"));
  if (labels.size() > gesture::kMaxLabels) {
    return ParameterFault{"labels", std::to_string(labels.size()) +
                                        " labels are too many at once; give at most " +
                                        std::to_string(gesture::kMaxLabels)};
  }
  if (!labels.empty() && !has_model) {
    return ParameterFault{"labels",
                          "labels need a gesture model to perform them; add model = \"H.gesture\""};
  }
  return std::nullopt;
}

Result<StageCommand> play(const StageModel* model, std::span<const std::string> words,
                          const Parameters& options) {
  if (model == nullptr) {
    return fail("there is no gesture model; send one with `posed ctl model STREAM H.gesture`");
  }
  const auto order =
      TRY(gesture::make_play_order(*gesture_of(model), words, parameter<double>(options, "tempo"),
                                   parameter<bool>(options, "loop")));
  return StageCommand::of(order);
}

void play_to_log(const StageCommand& command, v1::DecisionValue& value) {
  const auto order = command.as<PlayOrder>();
  for (const std::uint16_t label : order.labels()) value.mutable_play()->add_label(label);
  value.mutable_play()->set_tempo(order.tempo);
  value.mutable_play()->set_loop(order.loop);
}

std::optional<StageCommand> play_from_log(const v1::DecisionValue& value) {
  constexpr std::uint32_t kMaxLabelIndex = std::numeric_limits<std::uint16_t>::max();
  PlayOrder order;
  const auto& play = value.play();
  const std::size_t count = play.label_size();
  if (!value.has_play() || count == 0 || count > order.label.size()) return std::nullopt;
  for (const std::uint32_t label : play.label()) {
    if (label > kMaxLabelIndex) return std::nullopt;
    order.label[order.size++] = static_cast<std::uint16_t>(label);
  }
  order.tempo = play.tempo();
  order.loop = play.loop();
  const bool possible = order.tempo >= static_cast<float>(gesture::kMinTempo) &&
                        order.tempo <= static_cast<float>(gesture::kMaxTempo);
  return possible ? std::optional(StageCommand::of(order)) : std::nullopt;
}

Result<StageCommand> stop_playing(const StageModel* model, std::span<const std::string> words,
                                  const Parameters& /*options*/) {
  if (model == nullptr) return fail("nothing is performed here: there is no gesture model");
  if (!words.empty()) return misuse("stop-playing takes no labels");
  return StageCommand{};
}

std::vector<ParameterSpec> play_options() {
  return {{.name = "tempo",
           .default_value = 1.0,
           .help = "of the labels: 2 is twice as fast as learnt",
           .min = gesture::kMinTempo,
           .max = gesture::kMaxTempo},
          {.name = "loop", .default_value = false, .help = "repeat the labels until others come"}};
}

using Table = ParameterTable<smooth::LiveOptions, GenerateStage>;

// The parameters of the smoother, then what is performed from the start, which the options do not
// keep.
const Table& parameter_table() {
  static const Table table = [] {
    std::vector<Table::Row> rows{
        Table::row<[](auto& options) -> auto& { return options.lag.frames; }>(
            {.name = "lag_frames",
             .help = "frames by which the output lags behind; more are smoother",
             .min = 0.0,
             .max = kMaxLagFrames}),
        Table::row<[](auto& options) -> auto& { return options.lag.seconds; }>(
            {.name = "lag_s",
             .help = "the lag as a time instead; 0: use lag_frames",
             .min = 0.0,
             .max = smooth::kMaxLag_s,
             .display_name = "lag_ms",
             .display_scale = 1e3}),
        Table::row<&smooth::LiveOptions::noise_rad>(
            {.name = "noise_rad",
             .help = "standard deviation of the sensor's noise; 0: estimated from the stream",
             .min = 0.0,
             .max = kMaxNoise_rad,
             .display_name = "noise_deg",
             .display_scale = 1.0 / kDegree}),
        Table::row<&smooth::LiveOptions::error_rad>(
            {.name = "error_rad",
             .help = "how far off the device's angles are, beside noise; for naming gestures",
             .min = 0.0,
             .max = kMaxNoise_rad,
             .display_name = "error_deg",
             .display_scale = 1.0 / kDegree}),
        {.spec = {.name = "labels",
                  .default_value = std::string(),
                  .help = "performed from the start: \"g 1 c\""}}};
    for (ParameterSpec& option : play_options()) rows.push_back({.spec = std::move(option)});
    return Table(std::move(rows));
  }();
  return table;
}

Result<std::unique_ptr<Stage>> make(const StageContext& context, const StageModel* model) {
  if (context.skeleton->channels.empty() && model == nullptr) {
    return misuse("skeleton " + in_quotes(context.skeleton->name) +
                  " has no joint angles, so there is nothing to generate without a gesture model "
                  "of a body");
  }
  return std::make_unique<GenerateStage>(
      context.skeleton, parameter_table().options(context.parameters),
      stream_rate_hz(context.rate_hz), static_cast<const BoundModel*>(model));
}

// In the order of GenerateStage::Command.
std::vector<StageCommandType> commands() {
  return {{.name = "play",
           .help = "performs labels, after those that still wait",
           .options = play_options(),
           .performs = true,
           .refusal = "too many labels wait already; try again later, or stop them with `posed ctl"
                      " stop-playing STREAM`",
           .encode = play,
           .to_log = play_to_log,
           .from_log = play_from_log},
          {.name = "stop-playing",
           .help = "back to the live pose, or to rest",
           .encode = stop_playing}};
}

Result<std::optional<StageType::FirstCommand>> first_command(const Parameters& parameters,
                                                             const StageModel* model,
                                                             std::span<const std::byte> /*file*/) {
  const auto labels = gesture::split_labels(parameter<std::string>(parameters, "labels"));
  if (labels.empty()) return std::nullopt;
  const auto command = TRY(play(model, labels, parameters));
  return StageType::FirstCommand{GenerateStage::kPlay, command};
}

}  // namespace

const StageType& generate_type() {
  static const StageType type{
      .name = "generate",
      .summary =
          "smooths joint angles, and performs labels from a gesture model on a hand or a body",
      .words = "smooth and perform",
      .parameters = parameter_table().specs(),
      .input = StageInput::kLoses,
      .bridges = true,
      .check = check,
      .make = make,
      .takes = takes,
      .bind_model = bind,
      .commands = commands(),
      .first_command = first_command};
  return type;
}

}  // namespace posed::generate
