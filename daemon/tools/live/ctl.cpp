#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include <unistd.h>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "daemon/control/request_handler.hpp"
#include "daemon/control/uploads.hpp"
#include "daemon/pipeline/take.hpp"
#include "daemon/teach/teacher.hpp"
#include "daemon/tools/command/client.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/file_kind.hpp"
#include "daemon/tools/command/options.hpp"
#include "daemon/tools/live/live_view.hpp"
#include "daemon/tools/live/teach.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "models/gesture/play_order.hpp"
#include "models/stages/registry.hpp"
#include "models/style/live/style_type.hpp"
#include "posed/v1/control.pb.h"
#include "proto/log/digest.hpp"
#include "proto/message/bounded_parse.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/list.hpp"
#include "proto/text/load_file.hpp"
#include "proto/text/nearest_word.hpp"
#include "proto/text/parameter.hpp"

namespace posed::tools {
namespace {

struct CtlOptions {
  ClientOptions client;
  double timeout_s = 5.0;
  bool json = false;
  std::string stream, parameter, value;
  std::filesystem::path model, calibration;
  std::vector<float> force, vibration;
  std::string labels;
  double tempo = 1.0;
  double seconds = 0.0;  // of a warm-up
  bool loop = false;
  std::string take;      // name
  std::string new_name;  // of a model
  std::string stage;     // whose model is taken away
  TeachOptions teach;
};

Result<v1::ControlReply> ask(Connection& connection, const CtlOptions& options,
                             const v1::ControlRequest& request) {
  using Steady = std::chrono::steady_clock;
  const std::string bytes = request.SerializeAsString();
  // The daemon ends the connection of a peer who sends more, without a word.
  if (bytes.size() > control::kMaxRequest) {
    return fail(
        fmt::format("the request has {} bytes and may have {}: shorten its text, or send"
                    " labels in pieces",
                    bytes.size(), control::kMaxRequest));
  }
  if (!connection.send(bytes)) return fail("the request cannot be sent");
  const auto end = Steady::now() + std::chrono::duration<double>(options.timeout_s);
  while (Steady::now() < end && !Interrupt::came()) {
    if (auto refused = connection.refusal()) return std::unexpected(*refused);
    if (!connection.wait(kLookAround)) continue;
    net::Message message;
    if (!connection.receive(message)) continue;
    v1::ControlReply reply;
    if (message.more() || !message::parse_bounded(reply, message.bytes())) {
      return fail(options.client.endpoint + " does not answer like a posed daemon");
    }
    if (!reply.ok() && reply.error().empty()) {
      reply.set_error(options.client.endpoint + " refuses this and does not say why");
    }
    return reply;
  }
  if (Interrupt::came()) return fail("interrupted; the request may still take effect");
  Error silence = connection.no_answer();
  silence.message += fmt::format("; waited {} s", options.timeout_s);
  return std::unexpected(std::move(silence));
}

Result<v1::ControlReply> ask(const CtlOptions& options, const v1::ControlRequest& request) {
  const Interrupt interrupt;
  auto connection = TRY(Connection::open(options.client, ZMQ_DEALER));
  return ask(connection, options, request);
}

// Sends the model piece by piece. Returns the reply to the last piece, or the first refusal.
Result<v1::ControlReply> upload(const CtlOptions& options, const std::string& model) {
  const Interrupt interrupt;
  auto connection = TRY(Connection::open(options.client, ZMQ_DEALER));
  v1::ControlRequest request;
  auto& part = *request.mutable_model_part();
  part.set_stream(options.stream);
  part.set_name(options.model.filename().string());
  part.set_sha256(log::sha256_hex(std::as_bytes(std::span(model))));
  part.set_total(model.size());
  Result<v1::ControlReply> reply = fail("the model is empty", options.model);
  for (std::size_t offset = 0; offset < model.size(); offset += control::kMaxPiece) {
    part.set_offset(offset);
    part.set_bytes(model.substr(offset, control::kMaxPiece));
    reply = ask(connection, options, request);
    if (!reply || !reply->ok()) return reply;
  }
  return reply;
}

// Prints a reply as JSON, or with `print`.
template <typename Print>
int show(const CtlOptions& options, const Result<v1::ControlReply>& reply, Print&& print) {
  if (!reply) return report(reply.error());
  if (options.json) (void)print_json(*reply);
  if (!reply->ok()) return report(Error{reply->error(), {}, 0, ExitCode::kFailed});
  if (!options.json) print(*reply);
  return 0;
}

template <typename Print>
int ask_and_print(const CtlOptions& options, const v1::ControlRequest& request, Print&& print) {
  return show(options, ask(options, request), print);
}

// Prints which stream was changed, how, and from which frame on.
int show_change(const CtlOptions& options, const Result<v1::ControlReply>& reply,
                const std::string& what) {
  return show(options, reply, [&](const v1::ControlReply& accepted) {
    const std::string stream = clean_name(accepted.stream());
    if (accepted.sequence() == 0) {
      std::printf("%s: in effect when it comes: %s\n", stream.c_str(), what.c_str());
      return;
    }
    std::printf("%s: in effect from frame %llu: %s\n", stream.c_str(),
                static_cast<unsigned long long>(accepted.sequence()), what.c_str());
  });
}

int change(const CtlOptions& options, const v1::ControlRequest& request, const std::string& what) {
  return show_change(options, ask(options, request), what);
}

ParameterValue value_of_text(const std::string& text) {
  double number = 0.0;
  if (CLI::detail::lexical_cast(text, number)) return number;
  if (text == "true" || text == "false") return text == "true";
  return text;
}

// Refuses what no stage of this posed takes; only the daemon knows the stages of the stream.
Result<> check_parameter(const std::string& name, const ParameterValue& value) {
  std::set<std::string> known;
  std::optional<Error> wrong;  // for the first stage that has it
  for (const StageType* stage : stage_types()) {
    for (const ParameterSpec& spec : stage->parameters) {
      const std::string alone(spec.shown_name());
      const std::string whole = fmt::format("{}.{}", stage->name, alone);
      if (spec.live) known.insert({alone, whole});
      if (name != alone && name != whole) continue;
      const auto checked = from_display(spec, value, name);
      if (checked) return {};
      if (!wrong) wrong = checked.error();
    }
  }
  if (wrong) return std::unexpected(*wrong);
  const std::string near = nearest(name, known);
  return misuse(fmt::format("there is no parameter {}{}; `posed ctl set --help` lists them",
                            in_quotes(name), near.empty() ? "" : ", only " + near));
}

int set_parameter(const CtlOptions& options) {
  const ParameterValue value = value_of_text(options.value);
  if (const auto valid = check_parameter(options.parameter, value); !valid) {
    return report(valid.error());
  }
  v1::ControlRequest request;
  auto& wanted = *request.mutable_set_parameter();
  wanted.set_stream(options.stream);
  wanted.set_name(options.parameter);
  if (const auto* number = std::get_if<double>(&value)) wanted.set_number(*number);
  if (const auto* flag = std::get_if<bool>(&value)) wanted.set_flag(*flag);
  if (const auto* text = std::get_if<std::string>(&value)) wanted.set_text(*text);
  return change(options, request, options.parameter + " " + options.value);
}

int send_model(const CtlOptions& options) {
  const auto fits = expect_kind(options.model, FileKind::kModel, options.stream);
  if (!fits) return report(fits.error());
  const auto bytes = load_file(options.model, {.what = "model", .max_bytes = control::kMaxModel});
  if (!bytes) return report(bytes.error());
  return show_change(options, upload(options, *bytes),
                     "model " + options.model.filename().string());
}

int list_models(const CtlOptions& options) {
  v1::ControlRequest request;
  request.mutable_list_models();
  return ask_and_print(options, request, [](const v1::ControlReply& reply) {
    if (reply.model().empty()) {
      std::puts(
          "none: the folder that [control] models names in the daemon's config is empty, or"
          " none is named");
    }
    for (const v1::KnownModel& model : reply.model()) {
      std::printf("%-10s %s\n", clean(model.kind()).c_str(), clean(model.name()).c_str());
      for (const std::string& words : {model.learnt(), model.verdict()}) {
        if (!words.empty()) std::printf("           %s\n", clean(words).c_str());
      }
    }
  });
}

std::string state_of(const v1::KnownRecording& file) {
  if (!file.problem().empty()) return "  (is not there: " + clean(file.problem()) + ")";
  if (file.being_made()) return "  (is being made)";
  return file.in_use() ? "  (is being written)" : "";
}

int list_recordings(const CtlOptions& options) {
  v1::ControlRequest request;
  request.mutable_list_recordings();
  return ask_and_print(options, request, [](const v1::ControlReply& reply) {
    for (const v1::KnownRecording& file : reply.recording()) {
      std::printf("%10.1f MB  %s%s\n", static_cast<double>(file.bytes()) / 1e6,
                  clean(file.name()).c_str(), state_of(file).c_str());
    }
  });
}

int rename_model(const CtlOptions& options) {
  v1::ControlRequest request;
  request.mutable_rename_model()->set_name(options.model.string());
  request.mutable_rename_model()->set_to(options.new_name);
  return ask_and_print(options, request, [&](const v1::ControlReply&) {
    std::printf("%s is named %s now\n", options.model.c_str(), options.new_name.c_str());
  });
}

int delete_model(const CtlOptions& options) {
  v1::ControlRequest request;
  request.mutable_delete_model()->set_name(options.model.string());
  return ask_and_print(options, request, [&](const v1::ControlReply&) {
    std::printf("%s is deleted\n", options.model.c_str());
  });
}

int use_model(const CtlOptions& options) {
  v1::ControlRequest request;
  request.mutable_use_model()->set_stream(options.stream);
  request.mutable_use_model()->set_name(options.model.string());
  request.mutable_use_model()->set_stage(options.stage);
  return change(options, request, "model " + options.model.string());
}

int teach_stream(const CtlOptions& options) {
  const Interrupt interrupt;
  auto connection = Connection::open(options.client, ZMQ_DEALER);
  if (!connection) return report(connection.error());
  TeachOptions lesson = options.teach;
  lesson.stream = options.stream;
  lesson.quiet = options.json;
  const auto taught = teach(lesson, [&](const v1::ControlRequest& request) {
    auto reply = ask(*connection, options, request);
    if (reply && !reply->ok()) return Result<v1::ControlReply>(fail(reply->error()));
    return reply;
  });
  return show(options, taught, [](const v1::ControlReply&) {});
}

int play(const CtlOptions& options) {
  v1::ControlRequest request;
  auto& wanted = *request.mutable_stage_command();
  wanted.set_stream(options.stream);
  wanted.set_name("generate.play");
  for (std::string& label : gesture::split_labels(options.labels)) {
    wanted.add_word(std::move(label));
  }
  (*wanted.mutable_number())["tempo"] = options.tempo;
  (*wanted.mutable_number())["loop"] = options.loop ? 1.0 : 0.0;
  return change(options, request, "plays " + options.labels + " (after those that wait)");
}

constexpr std::string_view kWarmUp = "warm-up";  // of the style stage

// The stage says how long a warm-up may take and usually takes.
const ParameterSpec& warm_up_seconds() {
  const auto& commands = style::style_type().commands;
  const auto found = std::ranges::find(commands, kWarmUp, &StageCommandType::name);
  return *find_parameter(found->options, "seconds");
}

int warm_up(const CtlOptions& options) {
  v1::ControlRequest request;
  auto& wanted = *request.mutable_stage_command();
  wanted.set_stream(options.stream);
  wanted.set_name(fmt::format("{}.{}", style::style_type().name, kWarmUp));
  (*wanted.mutable_number())["seconds"] = options.seconds;
  return change(options, request, fmt::format("walk as usual for {:g} s", options.seconds));
}

int stop_playing(const CtlOptions& options) {
  v1::ControlRequest request;
  request.mutable_stage_command()->set_stream(options.stream);
  request.mutable_stage_command()->set_name("generate.stop-playing");
  return change(options, request, "plays no more");
}

int command_robot(const CtlOptions& options, const char* name, const char* what) {
  v1::ControlRequest request;
  request.mutable_stage_command()->set_stream(options.stream);
  request.mutable_stage_command()->set_name(std::string("robot.") + name);
  return change(options, request, what);
}

int engage(const CtlOptions& options) {
  return command_robot(options, "engage", "the robot follows the hand, once it can be trusted");
}

int release(const CtlOptions& options) {
  return command_robot(options, "release", "the robot brakes, and its frames are no commands");
}

// Checks everything about the file itself; only the daemon knows whether it fits the glove.
Result<std::string> read_calibration(const CtlOptions& options) {
  const auto& path = options.calibration;
  TRY(expect_kind(path, FileKind::kCalibration, options.stream));
  auto text = TRY(drivers::glove::load_calibration_text(path));
  TRY(drivers::glove::parse_calibration(text, path));
  return text;
}

int calibrate(const CtlOptions& options) {
  auto text = read_calibration(options);
  if (!text) return report(text.error());
  v1::ControlRequest request;
  auto& wanted = *request.mutable_calibrate();
  wanted.set_stream(options.stream);
  wanted.set_toml(std::move(*text));
  wanted.set_name(options.calibration.filename().string());
  return change(options, request, "calibration " + options.calibration.filename().string());
}

int haptics(const CtlOptions& options) {
  if (options.force.empty() && options.vibration.empty()) {
    return report(misuse("give --force, --vibrate or both").error());
  }
  v1::ControlRequest request;
  auto& wanted = *request.mutable_haptics();
  wanted.set_stream(options.stream);
  for (const float force : options.force) wanted.add_force(force);
  if (!options.vibration.empty()) {
    wanted.set_vibration_hz(options.vibration[0]);
    wanted.set_vibration_s(options.vibration[1]);
    wanted.set_vibration_amplitude(options.vibration[2]);
  }
  return ask_and_print(options, request, [&](const v1::ControlReply&) {
    std::printf("%s: sent to the glove, which does not answer; one without motors ignores it\n",
                options.stream.c_str());
  });
}

// Marks a take; prints which one has begun or ended.
int mark_take(const CtlOptions& options, bool start) {
  if (auto fine = pipeline::check_take_name(options.take); !fine) return report(fine.error());
  v1::ControlRequest request;
  request.mutable_take()->set_start(start);
  request.mutable_take()->set_name(options.take);
  return ask_and_print(options, request, [&](const v1::ControlReply& reply) {
    const pipeline::Take take{.number = reply.take().number(), .name = reply.take().name()};
    std::printf("%s %s\n", pipeline::words_of(take).c_str(), start ? "begins" : "has ended");
    if (reply.take().lost_chunks() > 0) {
      std::printf("meanwhile the log lost %llu chunks\n",
                  static_cast<unsigned long long>(reply.take().lost_chunks()));
    }
    if (!reply.recorder_trouble().empty()) {
      std::printf("nothing can be written to the log now: %s\n",
                  clean(reply.recorder_trouble()).c_str());
    }
  });
}

int start_take(const CtlOptions& options) { return mark_take(options, true); }
int stop_take(const CtlOptions& options) { return mark_take(options, false); }

int show_status(const CtlOptions& options) {
  v1::ControlRequest request;
  request.mutable_status();
  return ask_and_print(options, request, [&](const v1::ControlReply& reply) {
    LiveViewOptions view{.title = "posed " + options.client.endpoint, .height = 0};
    if (isatty(STDOUT_FILENO) == 0) view.width = 0;  // not a terminal: print whole names
    for (const std::string& line : live_view(reply.status(), view)) std::puts(line.c_str());
  });
}

int stop_daemon(const CtlOptions& options) {
  v1::ControlRequest request;
  request.mutable_stop();
  return ask_and_print(options, request,
                       [](const v1::ControlReply&) { std::puts("the daemon is ending"); });
}

constexpr const char* kExamples = R"(Examples:
  posed ctl set walker alpha 0.5
  posed ctl status
  posed ctl --connect tcp://stage:5571 --key me.key --server-key stage.pub stop
`posed ctl COMMAND --help` has examples of each. Exit code 0: it is in effect; 1: the daemon refused
or did not answer; 2: wrong use.)";

// The subcommands of `ctl`; each takes the options of `ctl` itself, too.
class Actions {
 public:
  Actions(CLI::App& command, std::shared_ptr<CtlOptions> options, int& exit_code)
      : command_(command), options_(std::move(options)), exit_code_(exit_code) {}

  CLI::App* add(const char* name, const char* help, int (*run)(const CtlOptions&),
                const std::string& footer) {
    CLI::App* action = command_.add_subcommand(name, help);
    action->footer(
        footer + "\n--connect, --key, --server-key, --timeout and --json: see `posed ctl --help`.");
    action->callback(
        [options = options_, run, &exit_code = exit_code_] { exit_code = run(*options); });
    return action;
  }
  CLI::App* add_for_stream(const char* name, const char* help, int (*run)(const CtlOptions&),
                           const std::string& footer) {
    CLI::App* action = add(name, help, run, footer);
    action->add_option("stream", options_->stream, "The stream, as its config names it")
        ->required();
    return action;
  }

 private:
  CLI::App& command_;
  std::shared_ptr<CtlOptions> options_;
  int& exit_code_;
};

// "  style.alpha   -2 to 2   how much style", a line each.
std::string live_parameters() {
  std::string lines;
  for (const StageType* stage : stage_types()) {
    for (const ParameterSpec& spec : stage->parameters) {
      if (!spec.live) continue;
      const bool flag = std::holds_alternative<bool>(spec.default_value);
      std::string range = flag ? "true or false"
                               : fmt::format("{:g} to {:g}", spec.min * spec.display_scale,
                                             spec.max * spec.display_scale);
      if (!has_number(spec)) range = "a=0.6,b=0.4";
      if (!spec.words.empty()) range = joined(spec.words);
      lines += fmt::format("  {:<26} {:<14} {}\n",
                           fmt::format("{}.{}", stage->name, spec.shown_name()), range, spec.help);
    }
  }
  return lines;
}

void add_teach(Actions& actions, TeachOptions& options) {
  CLI::App* lesson =
      actions.add_for_stream("teach", "Teach a body a style, or a hand signs, and it is in effect",
                             teach_stream, R"(Examples:
  posed ctl teach walker --name proud               # walk as you are, then as the character
  posed ctl teach walker --name proud --neutral 0   # once more as the character alone
  posed ctl teach walker --name proud --more        # further walks beside those before
  posed ctl teach hand --name signs --signs ok flat # show each sign three times
The stream needs publish_raw = true and a [stream.style] or [stream.generate] table (model = ""
while there is none), the daemon a folder to keep the model in: [control] models = "models". A walk
or a show of which nothing can be learnt is refused with the reason, and the stream stays as it is.
A show begins at rest, makes the sign, holds it and comes back to rest. Ctrl-C ends it.)");
  lesson
      ->add_option("--neutral", options.neutral_s,
                   "Seconds of the walk as usual, 6 to 120; 0: the one that was marked before")
      ->check(in_range(0.0, teach::kMaxWalk_s))
      ->capture_default_str();
  lesson->add_option("--style", options.style_s, "The same of the walk in the style")
      ->check(in_range(0.0, teach::kMaxWalk_s))
      ->capture_default_str();
  lesson->add_option("--signs", options.signs, "Signs to show, instead of walks");
  lesson->add_option("--show", options.show_s, "Seconds of a show, 3 to 15")
      ->check(in_range(teach::kMinShow_s, teach::kMaxShow_s))
      ->capture_default_str();
  lesson->add_flag("--more", options.more, "Learn these walks beside those before")
      ->excludes("--signs");
  lesson->add_flag("--anew", options.anew, "Forget a lesson that is not finished, of any stream");
  lesson
      ->add_option("--name", options.name,
                   "Of what is learnt, and of its file NAME.style or NAME.gesture")
      ->required();
}

void add_style_actions(Actions& actions, CtlOptions& options) {
  CLI::App* set =
      actions.add_for_stream("set", "Change a parameter of a stream's stages", set_parameter,
                             "Examples:\n"
                             "  posed ctl set walker alpha 0.5          # half the "
                             "style; alpha moves there slowly\n"
                             "  posed ctl set walker style.weights feminine=0.6,elderly=0.4\n"
                             "  posed ctl set walker auto_alpha true    # less "
                             "for who shows the style already\n"
                             "Parameters that a running daemon can change:\n" +
                                 live_parameters());
  set->add_option("parameter", options.parameter,
                  "STAGE.PARAMETER; the parameter alone where only one stage has it")
      ->required();
  set->add_option("value", options.value, "The new value, as in the config")->required();
  CLI::App* warm =
      actions.add_for_stream("warm-up", "Measure how a new walker usually walks", warm_up,
                             R"(Example:
  posed ctl warm-up walker --seconds 10   # it walks meanwhile; an event reports the end)");
  const ParameterSpec& seconds = warm_up_seconds();
  options.seconds = std::get<double>(seconds.default_value);
  warm->add_option("--seconds", options.seconds,
                   fmt::format("How long it walks, {:g} to {:g}", seconds.min, seconds.max))
      ->capture_default_str();
  CLI::App* model = actions.add_for_stream("model", "Give a stream another style or gesture model",
                                           send_model, R"(Examples:
  posed ctl model walker march.style   # another style, from the next frame on
  posed ctl model hand ours.gesture    # another gesture model: the file says what it is)");
  model->add_option("model", options.model, "The model file (M.style, H.gesture)")->required();
  static_cast<void>(actions.add("models", "List the models in the daemon's own folder", list_models,
                                "Example:\n  posed ctl models\nThe config names the folder: "
                                "[control] models = \"models\"."));
  CLI::App* use = actions.add_for_stream("use-model", "Give a stream a model of the daemon's list",
                                         use_model, R"(Example:
  posed ctl use-model walker march.style   # nothing is sent: the daemon has the file
  posed ctl use-model walker none          # the style fades out; warm up again after it)");
  use->add_option("model", options.model, "Its name, as `posed ctl models` prints it, or none")
      ->required();
  use->add_option("--stage", options.stage,
                  "With none, where two stages use models: style, generate");
  CLI::App* rename =
      actions.add("rename-model", "Give a model of the daemon's list another name", rename_model,
                  "Example:\n  posed ctl rename-model proud.style proud-ann");
  rename->add_option("model", options.model, "Its name, as `posed ctl models` prints it")
      ->required();
  rename->add_option("name", options.new_name, "The new one, without the ending")->required();
  CLI::App* gone = actions.add("delete-model", "Delete a model of the daemon's list for good",
                               delete_model, "Example:\n  posed ctl delete-model proud-2.style");
  gone->add_option("model", options.model, "Its name, as `posed ctl models` prints it")->required();
  static_cast<void>(actions.add("recordings", "List the logs and clips that the daemon shows",
                                list_recordings,
                                "Example:\n  posed ctl recordings\nThe config names their folder: "
                                "[control] recordings = \"takes\"."));
  add_teach(actions, options.teach);
}

void add_hand_actions(Actions& actions, CtlOptions& options) {
  CLI::App* perform = actions.add_for_stream("play", "Perform labels on a hand", play, R"(Examples:
  posed ctl play hand "g 1 c 3 4 p"    # after those that still wait
  posed ctl play hand "g c p" --tempo 1.5 --loop)");
  perform->add_option("labels", options.labels, "Names that the gesture model knows: \"g 1 c\"")
      ->required();
  perform->add_option("--tempo", options.tempo, "0.5 to 2 times the learnt one; 2 is twice as fast")
      ->capture_default_str();
  perform->add_flag("--loop", options.loop, "Repeat the labels until others come");
  static_cast<void>(actions.add_for_stream("stop-playing", "Back to the live hand", stop_playing,
                                           "Example:\n  posed ctl stop-playing hand"));
  static_cast<void>(actions.add_for_stream("engage", "Let a robot hand follow the hand", engage,
                                           R"(Example:
  posed ctl engage right   # a stream with [stream.robot]
After a restart the daemon's first command is `start` of [stream.robot], wherever the robot stands:
bring it there before.)"));
  static_cast<void>(actions.add_for_stream("release", "Let a robot hand stand", release,
                                           "Example:\n  posed ctl release right"));
}

void add_glove_actions(Actions& actions, CtlOptions& options) {
  CLI::App* fit = actions.add_for_stream("calibrate", "Give a glove another calibration", calibrate,
                                         R"(Example:
  posed ctl calibrate right ann.toml   # from the next packet on)");
  fit->add_option("calibration", options.calibration, "What `posed calibrate` wrote")->required();
  CLI::App* feel =
      actions.add_for_stream("haptics", "Send force or vibration to a glove with motors", haptics,
                             R"(Examples:
  posed ctl haptics right --force 0 0.5 0.5 0 0
  posed ctl haptics right --vibrate 80 0.2 0.5    # 80 Hz for 0.2 s at half the strength)");
  feel->add_option("--force", options.force,
                   "Thumb to little: 0 free to 1 blocked; negative leaves a finger as it is")
      ->expected(1, kFingers);
  feel->add_option("--vibrate", options.vibration, "Frequency [Hz], time [s], amplitude 0 to 1")
      ->expected(3);
}

void add_take_actions(CLI::App& command, const std::shared_ptr<CtlOptions>& options,
                      int& exit_code) {
  CLI::App* take = command.add_subcommand("take", "Mark a take in the recording");
  take->require_subcommand(1)->fallthrough();
  take->footer(
      "Examples:\n"
      "  posed ctl take start walk-3\n"
      "  posed ctl take stop\n"
      "  posed convert LOG.plog --takes       # later: what was marked");
  Actions actions(*take, options, exit_code);
  CLI::App* start = actions.add("start", "Begin a take, which ends the one that runs", start_take,
                                "Example:\n  posed ctl take start walk-3\nThe daemon numbers the "
                                "takes; names may repeat. It must be recording:\n`posed record`, "
                                "or `posed run` with a [record] table.");
  start->add_option("name", options->take, "Shown to people, at most 128 bytes; may be left out");
  static_cast<void>(
      actions.add("stop", "End the take that runs", stop_take, "Example:\n  posed ctl take stop"));
}

}  // namespace

void add_ctl(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("ctl", "Change or stop a running daemon");
  auto options = std::make_shared<CtlOptions>();
  command->require_subcommand(1)->fallthrough();
  add_client_options(*command, options->client, "tcp://127.0.0.1:5571");
  command->add_option("--timeout", options->timeout_s, "Seconds to wait for the answer")
      ->type_name("SECONDS")
      ->check(in_range(0.1, 3600.0))
      ->capture_default_str();
  command->add_flag("--json", options->json, "The answer as proto3 JSON (posed.v1.ControlReply)");
  command->footer(kExamples);
  Actions actions(*command, options, exit_code);
  add_style_actions(actions, *options);
  add_hand_actions(actions, *options);
  add_glove_actions(actions, *options);
  add_take_actions(*command, options, exit_code);
  static_cast<void>(actions.add("status", "Print the daemon's state once", show_status,
                                std::string("Examples:\n  posed ctl status\n  posed ctl --json "
                                            "status | jq .status.stream[0].state\n") +
                                    kColumnsHelp));
  static_cast<void>(actions.add("stop", "End the daemon cleanly", stop_daemon,
                                "Example:\n  posed ctl stop\nIt answers at once; a recording is "
                                "finished before the daemon ends."));
}

}  // namespace posed::tools
