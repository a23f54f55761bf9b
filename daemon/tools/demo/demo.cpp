// The demo: makes two families of synthetic walkers and a signer's glove recording, trains a style
// model from the families and a gesture model from the glove, streams a walker that is not in the
// training data through the daemon and watches it over ZeroMQ, as any client would.

#include <zmq.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "daemon/assembly/daemon.hpp"
#include "daemon/config/config.hpp"
#include "daemon/logging/log_output.hpp"
#include "daemon/tools/command/client.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/findings.hpp"
#include "daemon/tools/command/options.hpp"
#include "daemon/tools/command/output_files.hpp"
#include "daemon/tools/command/paint.hpp"
#include "daemon/tools/demo/demo_screen.hpp"
#include "daemon/tools/emulate/motions.hpp"
#include "daemon/tools/gesture/gesture_data.hpp"
#include "daemon/tools/gesture/train_gesture.hpp"
#include "daemon/tools/live/live_view.hpp"
#include "daemon/tools/live/page.hpp"
#include "daemon/tools/style/train_style.hpp"
#include "daemon/tools/view/bridge.hpp"
#include "models/gesture/camera_takes.hpp"
#include "models/gesture/synthetic_signer.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "proto/clip/hand_clip.hpp"
#include "proto/clip/label_file.hpp"
#include "proto/frame/config_texts.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/whole_file.hpp"
#include "proto/log/digest.hpp"
#include "proto/text/load_file.hpp"

namespace posed {
std::span<const ConfigText> config_texts();  // config/*.toml, which CMake writes
}

namespace posed::tools {
namespace {

using SteadyClock = std::chrono::steady_clock;
constexpr double kFirstFrameWithin_s = 10.0;
constexpr double kHandRate_hz = 30.0;

// The demo's config in its folder: config/demo.toml, which is part of the binary, with the paths of
// that folder.
constexpr const char* kDemoConfig = "demo.toml";

// The folder for the demo's clips and models, and the check whether they are what this program
// would make again.
class DemoFolder {
 public:
  explicit DemoFolder(std::filesystem::path path) : path_(std::move(path)) {}

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  // Whether every file is there as this program wrote it; false after another build of posed wrote
  // them, or after a file was changed.
  [[nodiscard]] bool is_up_to_date() const;

  // Refuses a folder with files of these names that no demo wrote; `overwrite` allows it.
  Result<> check_is_own(const std::vector<std::string>& names, bool overwrite) const;

  // Marks the folder as the demo's before its files come: one that was interrupted is made anew.
  Result<> begin() const;

  // Writes the config, and the stamp that is_up_to_date() reads, with a hash of every file in the
  // folder.
  Result<> finish() const;

 private:
  std::filesystem::path path_;
};

namespace fs = std::filesystem;
constexpr const char* kStamp = "demo.json";
constexpr const char* kPageToken = "page.token";
constexpr std::uintmax_t kMaxStamp = 64 * 1024;      // bytes of the stamp file
constexpr std::uintmax_t kMaxBytes = 1'000'000'000;  // of the program, or of a file that it wrote

// Empty if the file cannot be read.
std::string digest_of(const fs::path& file) {
  const auto bytes = load_file(file, {.what = "file", .max_bytes = kMaxBytes});
  return bytes ? log::sha256_hex(std::as_bytes(std::span(*bytes))) : std::string();
}

// A hash of the whole program, because another build may train other models.
std::string program_digest() { return digest_of("/proc/self/exe"); }

// The training data and the streams of the demo: synthetic walkers as BVH files, a synthetic
// signer's glove as CSV with labels, and the names of the models trained from them.

// The style model's file name in the demo's folder; config/demo.toml names it, too.
constexpr const char* kDemoModel = "walk-to-sneak.style";
// The walker that is streamed; it is not in the training data.
constexpr const char* kDemoWalker = "new_walker.bvh";

// The gesture model, trained with g, c and p; and a signer who is not in its training data.
constexpr const char* kDemoHand = "hand.gesture";
constexpr const char* kDemoSigner = "new_performer.csv";

// The model for a camera's hands, trained with g, c, p, 1, 3 and 4 as a camera sees them.
constexpr const char* kDemoCamera = "camera.gesture";

struct LabelledClip {
  std::filesystem::path clip, labels;
};

struct DemoClips {
  std::vector<std::filesystem::path> from, to;  // walks of the two families
  LabelledClip glove;                           // 100 gestures of one signer
  std::vector<LabelledClip> camera;             // takes of drawn hands
};

constexpr std::uint32_t kPeople = 6;  // of each family
constexpr std::uint32_t kNewPerson = 21;
constexpr double kNewWalkSeconds = 24.0;
constexpr const char* kGlove = "glove_train";
constexpr std::size_t kCameraTakes = 32;

Result<std::filesystem::path> write_walker(const std::filesystem::path& path,
                                           const motion::WalkerOptions& options) {
  const auto walk = TRY(motion::make_walker(options));
  TRY(clip::write_bvh(walk, path));
  return path;
}

std::string camera_take(std::size_t take) { return fmt::format("camera_train_{}", take + 1); }

Result<LabelledClip> write_performance(const gesture::Performance& performance,
                                       const std::filesystem::path& folder,
                                       const std::string& name) {
  LabelledClip files{.clip = folder / (name + ".csv"), .labels = folder / (name + ".lab")};
  TRY(clip::write_hand_csv(performance.clip, files.clip));
  TRY(clip::write_labels(performance.labels, files.labels));
  return files;
}

// Writes the recordings for training, with labels, and a new person who performs g, c, p.
Result<> write_hands(const std::filesystem::path& folder, DemoClips& clips) {
  const auto performance = TRY(gesture::make_performance({}));
  clips.glove = TRY(write_performance(performance, folder, kGlove));
  for (const gesture::Performance& take : gesture::camera_takes()) {
    auto written = TRY(write_performance(take, folder, camera_take(clips.camera.size())));
    clips.camera.push_back(std::move(written));
  }
  const auto signer = TRY(gesture::make_performance(
      {.person = kNewPerson, .script = {"g", "c", "p", "g", "c", "p", "c", "g", "p", "c"}}));
  return clip::write_hand_csv(signer.clip, folder / kDemoSigner);
}

// The files that make_demo_clips() and the training write into the folder.
std::vector<std::string> demo_file_names() {
  std::vector<std::string> names{kDemoModel, kDemoWalker, kDemoHand, kDemoSigner, kDemoCamera};
  const auto add_hand = [&names](const std::string& name) {
    names.push_back(name + ".csv");
    names.push_back(name + ".lab");
  };
  add_hand(kGlove);
  for (std::size_t take = 0; take < kCameraTakes; ++take) add_hand(camera_take(take));
  for (std::uint32_t person = 1; person <= kPeople; ++person) {
    names.push_back(fmt::format("walk_{}.bvh", person));
    names.push_back(fmt::format("sneak_{}.bvh", person));
  }
  return names;
}

// Writes the clips of both families and the new walker, the glove recording with its labels and the
// new signer into `folder`, which is created.
Result<DemoClips> make_demo_clips(const std::filesystem::path& folder) {
  std::error_code made;
  std::filesystem::create_directories(folder, made);
  if (made) return fail("cannot make the folder: " + made.message(), folder.string());
  DemoClips clips;
  for (std::uint32_t person = 1; person <= kPeople; ++person) {
    auto walk = TRY(write_walker(folder / fmt::format("walk_{}.bvh", person),
                                 {.family = motion::WalkerFamily::kWalk, .person = person}));
    clips.from.push_back(std::move(walk));
    auto sneak = TRY(write_walker(folder / fmt::format("sneak_{}.bvh", person),
                                  {.family = motion::WalkerFamily::kSneak, .person = person}));
    clips.to.push_back(std::move(sneak));
  }
  TRY(write_walker(folder / kDemoWalker, {.family = motion::WalkerFamily::kWalk,
                                          .person = kNewPerson,
                                          .seconds = kNewWalkSeconds,
                                          .round = true}));
  TRY(write_hands(folder, clips));
  return clips;
}

// What the folder's stamp says while its files are those that this program wrote.
std::string stamp_of(const fs::path& folder) {
  Findings files;
  for (const std::string& name : demo_file_names()) files.add(name, digest_of(folder / name));
  files.add(kDemoConfig, digest_of(folder / kDemoConfig));
  return Findings().add("program", program_digest()).add("files", files).json(2) + "\n";
}

std::string config_text() {
  for (const ConfigText& text : config_texts()) {
    if (text.file != kDemoConfig) continue;
    std::string toml =
        "# `posed demo` writes this file, and again when it makes new models: copy it "
        "before you change it.\n" +
        std::string(text.content);
    constexpr std::string_view kInSourceTree = "../build/demo/";
    // The folder itself, of models: an empty text would name none.
    const std::string whole = "\"" + std::string(kInSourceTree) + "\"";
    if (const auto at = toml.find(whole); at != std::string::npos) {
      toml.replace(at, whole.size(), "\".\"");
    }
    for (auto at = toml.find(kInSourceTree); at != std::string::npos;
         at = toml.find(kInSourceTree)) {
      toml.erase(at, kInSourceTree.size());
    }
    return toml;
  }
  return {};
}

// $XDG_CACHE_HOME/posed/demo, or ~/.cache/posed/demo.
Result<fs::path> demo_cache_folder() {
  const auto absolute = [](const char* name) -> fs::path {
    const char* value = std::getenv(name);
    const fs::path path = value == nullptr ? fs::path() : fs::path(value);
    return path.is_absolute() ? path : fs::path();
  };
  fs::path cache = absolute("XDG_CACHE_HOME");
  if (cache.empty() && !absolute("HOME").empty()) cache = absolute("HOME") / ".cache";
  if (cache.empty()) {
    return misuse("neither XDG_CACHE_HOME nor HOME names a folder; give --folder DIR");
  }
  return cache / "posed" / "demo";
}

bool DemoFolder::is_up_to_date() const {
  const auto text = load_file(path_ / kStamp, {.what = "stamp", .max_bytes = kMaxStamp});
  return text && *text == stamp_of(path_);
}

Result<> DemoFolder::check_is_own(const std::vector<std::string>& names, bool overwrite) const {
  std::error_code error;
  if (overwrite || fs::exists(path_ / kStamp, error)) return {};
  // of a version of the demo that wrote no stamp
  if (fs::exists(path_ / kDemoModel, error)) return {};
  for (const std::string& name : names) {
    if (!fs::exists(path_ / name, error)) continue;
    return misuse("exists already, and no demo wrote it; name another folder, or add --overwrite",
                  (path_ / name).string());
  }
  return {};
}

Result<> DemoFolder::begin() const {
  std::error_code error;
  fs::create_directories(path_, error);
  if (error) return fail("cannot make the folder: " + error.message(), path_.string());
  return write_whole_file(path_ / kStamp, "{}\n");
}

Result<> DemoFolder::finish() const {
  TRY(write_whole_file(path_ / kDemoConfig, config_text()));
  return write_whole_file(path_ / kStamp, stamp_of(path_));
}

struct DemoOptions {
  std::filesystem::path config;   // empty: the demo's own
  std::filesystem::path folder;   // of clips and models; empty: the user's cache
  std::filesystem::path prepare;  // only make clips and models in this folder
  std::optional<double> seconds;
  bool overwrite = false;
  bool no_browser = false;
};

Result<> learn_gestures(const std::vector<LabelledClip>& clips, double rate_hz, bool held,
                        const fs::path& model) {
  std::vector<gesture::Recording> recordings;
  for (const LabelledClip& files : clips) {
    auto recording = TRY(load_recording(files.clip, files.labels, rate_hz));
    recordings.push_back(std::move(recording));
  }
  OneRank alone;
  TRY(train_gesture_and_save(recordings, {.held = held}, model, alone));
  return {};
}

// Makes the demo's files, unless this program has made them before.
Result<> prepare(const std::filesystem::path& folder, bool overwrite) {
  const DemoFolder kept(folder);
  TRY(kept.check_is_own(demo_file_names(), overwrite));
  if (kept.is_up_to_date()) {
    std::fprintf(stderr, "1-3/4 using what was made and learnt before, in %s\n", folder.c_str());
    return {};
  }
  std::fprintf(stderr, "1/4 making synthetic walkers and a synthetic signer in %s\n",
               folder.c_str());
  TRY(kept.begin());
  const auto clips = TRY(make_demo_clips(folder));
  std::fprintf(stderr, "2/4 learning the style walk -> sneak from %zu clips\n",
               clips.from.size() + clips.to.size());
  Experiment experiment;
  experiment.targets = {"sneak"};
  // The same number is the same person in both families.
  for (std::size_t i = 0; i < clips.from.size(); ++i) {
    const std::string person = std::to_string(i + 1);
    experiment.clips.push_back({clips.from[i], "walk", person, "walk", 0});
    experiment.clips.push_back({clips.to[i], "sneak", person, "walk", 0});
  }
  OneRank alone;
  const auto trained = TRY(train_and_save(experiment, 0, {.model = folder / kDemoModel}, alone));
  const std::string& verdict = trained.verdict.sentence;
  if (!trained.written) return fail("the demo's own model is " + verdict);
  std::fprintf(stderr, "    %s\n", verdict.c_str());
  std::fprintf(stderr, "3/4 learning the gestures g, c and p from a labelled glove recording\n");
  TRY(learn_gestures({clips.glove}, kHandRate_hz, false, folder / kDemoHand));
  std::fprintf(stderr, "    and g, c, p, 1, 3 and 4 from %zu takes of hands before a camera\n",
               clips.camera.size());
  TRY(learn_gestures(clips.camera, gesture::kCameraRate_hz, true, folder / kDemoCamera));
  return kept.finish();
}

// Receives every message that waits.
void drain(Connection& connection, Watcher& watcher, DemoScreen& screen) {
  net::Message topic, body;
  while (connection.receive(topic, body)) {
    screen.handle(topic.text(), body.bytes());
    if (!topic.text().starts_with("pose/")) continue;
    watcher.handle(std::string(topic.text()), body.bytes().data(), body.bytes().size());
  }
}

double seconds_since(SteadyClock::time_point then) {
  return std::chrono::duration<double>(SteadyClock::now() - then).count();
}

// Serves the page for the browser. Null if it cannot be, which a line says: the terminal shows the
// streams, too.
std::unique_ptr<view::Bridge> serve_page_of(const assembly::Daemon& daemon,
                                            const DemoOptions& options, const fs::path& folder) {
  const auto why_not = [](const Error& error) {
    logging::say("posed: no page beside this terminal: " + error.text());
    return nullptr;
  };
  const auto page = find_page({});
  if (!page) return why_not(page.error());
  auto bridge = view::Bridge::start({.link = {.publish = {.endpoint = daemon.publish_endpoint()},
                                              .control = daemon.control_endpoint()},
                                     .page = *page,
                                     .or_any_port = true,
                                     .token = view::kept_token(folder / kPageToken)});
  if (!bridge) return why_not(bridge.error());
  std::fprintf(stderr, "see it: %s\n", (*bridge)->url().c_str());
  if (!options.no_browser) open_browser((*bridge)->url());
  return std::move(*bridge);
}

// Shows the running daemon until Ctrl-C or until `seconds` after the first frame. `url`: the page's
// address; empty: there is none.
Result<> watch(const assembly::Daemon& daemon, const DemoOptions& options, const std::string& url,
               Watcher& watcher, DemoStyle& style, DemoHand& hand) {
  ClientOptions client;
  client.endpoint = daemon.publish_endpoint();
  auto connection = TRY(Connection::open(client, ZMQ_SUB));
  TRY(connection.subscribe("pose/"));
  DemoScreen screen(daemon, connection, url);
  const auto start = SteadyClock::now();
  std::optional<SteadyClock::time_point> first_frame;
  while (!Interrupt::came() && !screen.quits() && !daemon.asked_to_stop()) {
    if (connection.wait(kLookAround)) drain(connection, watcher, screen);
    if (!first_frame && watcher.styled() > 0) first_frame = SteadyClock::now();
    if (first_frame && options.seconds && seconds_since(*first_frame) >= *options.seconds) break;
    if (first_frame) {
      const double seconds = seconds_since(*first_frame);
      TRY(style.tend(seconds, [&daemon] { return daemon.stats(); }));
      TRY(hand.tend(seconds));
    }
    if (!first_frame && seconds_since(start) > kFirstFrameWithin_s) {
      return fail("no styled frame arrived within 10 s; the log above says why");
    }
    screen.show(watcher, style, hand);
  }
  return {};
}

// Starts a synthetic signer for every stream whose device is not set in the config.
using Signers = std::vector<std::unique_ptr<emulate::SyntheticSigner>>;
Result<Signers> put_on_gloves(config::DaemonConfig& config, const std::filesystem::path& clip) {
  Signers signers;
  for (config::StreamConfig& stream : config.streams) {
    const auto port = stream.options.find("port");
    if (port == stream.options.end() || !std::get<std::string>(port->second).empty()) continue;
    auto signer = TRY(emulate::SyntheticSigner::start(stream.driver, clip, config.realtime));
    port->second = signer->port();
    signers.push_back(std::move(signer));
  }
  return signers;
}

// What was seen, for a terminal of 80 columns.
void print_summary(const Watcher& watcher, const DemoHand& hand, const v1::Stats& stats) {
  const auto print = [](const std::string& text) {
    for (const std::string& line : wrapped(text, 80, "  ")) std::puts(line.c_str());
  };
  print(fmt::format(
      "received {} styled frames over ZeroMQ, {} missing; {:.1f} deg rms from the raw poses",
      watcher.styled(), watcher.gaps(), watcher.change_deg()));
  if (const std::string summary = hand.summary(); !summary.empty()) print(summary);
  for (const v1::StreamStats& s : stats.stream()) {
    print(
        fmt::format("{}: {:.1f} frames/s, arrival to ZeroMQ {} (99 %: {}), dropped {}, skipped {}",
                    s.stream(), s.rate_hz(), display_duration(s.publish().p50_us() * 1e-6),
                    display_duration(s.publish().p99_us() * 1e-6), s.dropped(), s.shed()));
  }
}

Result<> stream(const DemoOptions& options, const std::filesystem::path& folder) {
  const auto own = folder / kDemoConfig;
  auto config =
      TRY(config::load_config(options.config.empty() ? own : options.config, drivers::registry()));
  logging::sum_up_repeats();
  const Interrupt interrupt;
  const auto gloves = TRY(put_on_gloves(config, folder / kDemoSigner));
  auto daemon = TRY(assembly::Daemon::open(config));
  TRY(daemon->start());
  const auto bridge = serve_page_of(*daemon, options, folder);
  std::fprintf(stderr, "4/4 streaming %s (not learnt from) on %s\n", kDemoWalker,
               daemon->publish_endpoint().c_str());
  auto style = TRY(DemoStyle::open(daemon->control_endpoint()));
  auto hand = TRY(DemoHand::open(daemon->control_endpoint()));
  Watcher watcher(hand);
  const std::string url = bridge ? bridge->url() : "";
  const auto watched = watch(*daemon, options, url, watcher, style, hand);
  const v1::Stats stats = daemon->stats();
  daemon->stop();
  if (!watched) return watched;
  std::puts("");
  print_summary(watcher, hand, stats);
  return {};
}

// The folder for clips and models, in which the config looks for them.
Result<std::filesystem::path> folder_of(const DemoOptions& options) {
  std::error_code ignored;  // the folder in which the daemon runs may be gone
  if (!options.folder.empty()) return std::filesystem::absolute(options.folder, ignored);
  if (options.config.empty()) return demo_cache_folder();
  const auto config = TRY(config::load_config(options.config, drivers::registry()));
  for (const config::StreamConfig& stream : config.streams) {
    for (const config::StageConfig& stage : stream.stages) {
      if (stage.model.filename() != kDemoModel) continue;
      return std::filesystem::absolute(stage.model, ignored).lexically_normal().parent_path();
    }
  }
  return misuse("no stream has the demo's model, " + std::string(kDemoModel) +
                    "; `posed run --config` streams any other config",
                options.config.string());
}

Result<> check_options(const DemoOptions& options) {
  if (!options.prepare.empty() && (!options.config.empty() || !options.folder.empty() ||
                                   options.seconds || options.no_browser)) {
    return misuse(
        "--prepare streams nothing; leave out --config, --folder, --seconds and --no-browser");
  }
  if (!options.config.empty() && !options.folder.empty()) {
    return misuse("--config says where its files are; leave out --folder");
  }
  return {};
}

Result<> demo(const DemoOptions& options) {
  TRY(check_options(options));
  if (!options.prepare.empty()) return prepare(options.prepare, options.overwrite);
  const auto folder = TRY(folder_of(options));
  TRY(prepare(folder, options.overwrite));
  return stream(options, folder);
}

}  // namespace

void add_demo(CLI::App& app, int& exit_code) {
  auto* command =
      app.add_subcommand("demo", "Learn a style from synthetic walkers and stream a new one");
  const auto options = std::make_shared<DemoOptions>();
  command->add_option("--config", options->config, "What to stream (default: the demo's own)")
      ->type_name("FILE.toml");
  command
      ->add_option("--folder", options->folder,
                   "Where clips and models are kept (default: ~/.cache/posed/demo)")
      ->type_name("DIR");
  command
      ->add_option("--prepare", options->prepare,
                   "Only make the clips and the models in this folder")
      ->type_name("DIR");
  add_overwrite_option(*command, options->overwrite);
  command->add_option("--seconds", options->seconds, "End so long after the first frame")
      ->check(above_zero());
  command->add_flag("--no-browser", options->no_browser,
                    "Print the page's address, open no browser");
  command->footer(R"(Examples:
  posed demo                      # from anywhere; its first line is the page for your browser
  posed demo --seconds 10
  posed demo --prepare build/demo # what ./run build does
Clips and models are kept in $XDG_CACHE_HOME/posed/demo (~/.cache/posed/demo), with a demo.toml that
`posed run --config` streams, too; another build of posed makes them again.)");
  command->callback([options, &exit_code] { exit_code = report(demo(*options)); });
}

}  // namespace posed::tools
