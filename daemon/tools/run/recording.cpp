#include "daemon/tools/run/recording.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cctype>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdint>
#include <ctime>
#include <memory>
#include <mutex>
#include <set>
#include <stop_token>
#include <system_error>
#include <thread>
#include <utility>
#include <variant>

#include <spdlog/fmt/chrono.h>
#include <spdlog/fmt/fmt.h>

#include "daemon/assembly/daemon.hpp"
#include "daemon/record/recorder.hpp"
#include "daemon/system/clock.hpp"
#include "daemon/system/realtime.hpp"
#include "daemon/tools/command/findings.hpp"
#include "daemon/tools/command/output_files.hpp"
#include "daemon/tools/export/log_clip.hpp"
#include "proto/clip/clip.hpp"
#include "proto/clip/frames_clip.hpp"
#include "proto/frame/whole_file.hpp"
#include "proto/log/schema.hpp"
#include "proto/log/writer.hpp"
#include "proto/text/clean.hpp"

namespace posed::tools {
namespace {

// SetAside keeps a device log that is about to be replaced under another name until the new log has
// been started successfully.
class SetAside {
 public:
  // Renames the files of the log `file`, if there are any, to <file>.<pid>.replaced. The error says
  // why that is impossible. An empty path: nothing is replaced.
  static Result<SetAside> move(const std::filesystem::path& file);
  SetAside(SetAside&& other) noexcept : file_(std::exchange(other.file_, {})) {}
  SetAside& operator=(SetAside&&) = delete;
  // Gives the old log its name back, unless release() was called, or the name is somebody else's by
  // now.
  ~SetAside();

  // The replacement has succeeded: deletes the old file.
  void release() noexcept;

 private:
  explicit SetAside(std::filesystem::path file) : file_(std::move(file)) {}
  [[nodiscard]] std::string aside() const {
    return file_.string() + "." + std::to_string(::getpid()) + ".replaced";
  }

  std::filesystem::path file_;  // empty: nothing to restore
};

// Whether another process holds a lock of SQLite's, as its writer does all the time.
bool is_in_use(const std::filesystem::path& file) {
  const int fd = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) return false;
  struct flock lock{};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  const bool known = ::fcntl(fd, F_GETLK, &lock) == 0;
  ::close(fd);
  return known && lock.l_type != F_UNLCK;
}

Result<SetAside> SetAside::move(const std::filesystem::path& file) {
  if (is_in_use(file)) {
    return fail("is in use by another process; end that, or name another file", file.string());
  }
  SetAside kept(file);
  for (const char* suffix : log::kFileSuffixes) {
    std::error_code error;  // for most suffixes there is no file
    if (file.empty()) break;
    std::filesystem::rename(file.string() + suffix, kept.aside() + suffix, error);
    if (error && error != std::errc::no_such_file_or_directory) {
      return fail("cannot be replaced: " + error.message(), file.string() + suffix);
    }
  }
  return kept;
}

SetAside::~SetAside() {
  for (const char* suffix : log::kFileSuffixes) {
    if (file_.empty() || rename_to_new(aside() + suffix, file_.string() + suffix)) continue;
    if (errno == ENOENT) continue;
    spdlog::error("the old {} is now {}: {}", file_.string() + suffix, aside() + suffix,
                  errno_text());
  }
}

void SetAside::release() noexcept {
  for (const char* suffix : log::kFileSuffixes) {
    std::error_code ignored;
    if (!file_.empty()) std::filesystem::remove(aside() + suffix, ignored);
  }
  file_.clear();
}

// Publishes what the recorder reports on event/<stream> of the streams that it concerns.
void post(assembly::Daemon& daemon, const record::RecorderEvent& event) {
  constexpr std::array<v1::Event::Kind, 3> kKinds{
      v1::Event::KIND_RECORDING_GAP, v1::Event::KIND_RECORDING_ERROR, v1::Event::KIND_TAKE};
  const auto kind = kKinds[static_cast<std::size_t>(event.kind)];
  for (const std::uint32_t stream : event.streams) daemon.post_event(stream, kind, event.text);
}

// Datagrams that never came to posed.
std::uint64_t kernel_dropped(const assembly::Daemon& daemon) {
  std::uint64_t dropped = 0;
  for (const auto& source : daemon.sources()) dropped += source->counters.kernel_dropped.load();
  return dropped;
}

metrics::RecorderFigures figures_of(const record::Recorder& recorder) {
  return {.file = recorder.file(),
          .lost_chunks = recorder.lost_chunks(),
          .lost_frames = recorder.lost_frames(),
          .errors = recorder.errors(),
          .error_ns = recorder.error_ns()};
}

std::string missing_words(const record::Recorder& recorder, std::uint64_t dropped) {
  const std::uint64_t lost = recorder.lost_chunks(), errors = recorder.errors();
  std::string words;
  if (lost + errors > 0) {
    words = fmt::format("{} chunks are missing after {} write errors; `posed replay` says where",
                        lost, errors);
  }
  if (recorder.lost_frames() > 0) {
    words += fmt::format("{}{} published frames are missing, which `posed replay` makes again",
                         words.empty() ? "" : "; ", recorder.lost_frames());
  }
  if (dropped > 0) {
    words += fmt::format("{}the kernel dropped {} datagrams before posed could read them",
                         words.empty() ? "" : "; ", dropped);
  }
  return words.empty() ? "nothing is missing" : words;
}

// Prints a summary. Gaps were already reported when they happened.
void print_result(const RecordingPlan& options, const assembly::Daemon& daemon,
                  const record::Recorder& recorder, double took_s) {
  const v1::Stats stats = daemon.stats();
  const std::string file = recorder.file().string();
  std::error_code gone;  // somebody deleted the log meanwhile
  const auto size = std::filesystem::file_size(file, gone);
  const std::uintmax_t bytes = gone ? 0 : size;
  std::uint64_t frames = stats.left_frames(), samples = stats.left_samples();
  const bool some_left = frames + samples > 0;
  std::vector<Findings> streams;
  for (const v1::StreamStats& stream : stats.stream()) {
    frames += stream.frames();
    samples += stream.samples();
    streams.push_back(Findings()
                          .add("stream", stream.stream())
                          .add("frames", stream.frames())
                          .add("samples", stream.samples()));
  }
  const std::uint64_t lost = recorder.lost_chunks() + recorder.lost_frames();
  const std::uint64_t dropped = kernel_dropped(daemon);
  if (options.json) {
    Findings()
        .add("file", file)
        .add("seconds", took_s)
        .add("bytes", bytes)
        .add("frames", frames)
        .add("samples", samples)
        .add("streams", streams)
        .add("left_frames", stats.left_frames())
        .add("left_samples", stats.left_samples())
        .add("missing_chunks", recorder.lost_chunks())
        .add("missing_frames", recorder.lost_frames())
        .add("kernel_dropped", dropped)
        .add("write_errors", recorder.errors())
        .show(true, -1);
  }
  spdlog::log(lost + recorder.errors() + dropped > 0 ? spdlog::level::warn : spdlog::level::info,
              "{}: {:.1f} s of {} stream{}{}, {} frames and {} samples published, {:.1f} MB; {}",
              file, took_s, stats.stream_size(), stats.stream_size() == 1 ? "" : "s",
              some_left ? " and those that have left" : "", frames, samples,
              static_cast<double>(bytes) / 1e6, missing_words(recorder, dropped));
}

void add_models(OutputFiles& files, const config::StreamConfig& stream) {
  for (const config::StageConfig& stage : stream.stages) files.reads(stage.model);
}

void add_clip(OutputFiles& files, const drivers::Options& options) {
  const auto path = options.find("path");
  if (path == options.end()) return;
  if (const auto* clip = std::get_if<std::string>(&path->second)) files.reads(*clip);
}

// The log must not be one of the files that the daemon reads.
Result<> check_out(const RecordingPlan& options, const config::DaemonConfig& config) {
  OutputFiles files(options.overwrite);
  files.reads(options.serve.config).writes_any_but_other(options.out, {".plog"});
  for (const config::StreamConfig& stream : config.streams) {
    files.reads(stream.calibration);
    add_models(files, stream);
    add_clip(files, stream.options);
  }
  for (const config::SourceConfig& source : config.sources) {
    add_models(files, source.every);
    for (const auto& named : source.named) add_models(files, named.stream);
    add_clip(files, source.options);
  }
  return files.check();
}

// The name of a log, and whether its file is there already and ours.
struct LogName {
  std::filesystem::path path;
  bool reserved = false;
};

// Takes a name in the folder, after the present time, that no file has:
// <folder>/20261123T013005Z.plog, and with .2, .3 where other daemons were first. A full disk stops
// recording and not streaming, so then the name is to be taken later.
Result<LogName> new_log(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return fail("this folder for recordings cannot be made: " + error.message(), folder.string());
  }
  const std::string time = fmt::format("{:%Y%m%dT%H%M%SZ}", fmt::gmtime(std::time(nullptr)));
  for (int number = 1;; ++number) {
    const auto path = folder / (time + (number > 1 ? fmt::format(".{}", number) : "") + ".plog");
    const auto name = TRY(log::reserve(path));
    if (name != log::Reserved::kTaken) return LogName{path, name == log::Reserved::kYes};
  }
}

// Each take of each stream of a device log as a BVH beside it. Cold.
class TakeClips {
 public:
  // A thread of nice 19 writes the clips of each take soon after it has ended, while `log` grows.
  explicit TakeClips(std::filesystem::path log);
  TakeClips(const TakeClips&) = delete;
  TakeClips& operator=(const TakeClips&) = delete;
  ~TakeClips() = default;

  // A take has begun or ended. Any thread; returns at once.
  void take_changed();
  // Ends the thread, which may be reading the log: before the log becomes a single file, because
  // that needs it alone.
  void stop();
  // After stop(), when the log is complete: writes those that are not written yet, also of a take
  // that was never ended. Call once. An end signal that comes meanwhile ends the work with an
  // error: block end_signals() before.
  Result<> finish();

 private:
  void run(const std::stop_token& stop);
  Result<> write(bool all, const std::stop_token& stop);

  std::filesystem::path log_;
  // Takes and streams; of the thread, then of finish().
  std::set<std::pair<std::int64_t, std::string>> written_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  bool changed_ = false;
  std::jthread thread_;  // last, because it uses all the others
};

// A take's name as a part of its clips' names: ".sneak"; empty without one.
std::string ending_named(const std::string& take) {
  constexpr std::size_t kMaxBytes = 100;
  std::string text = take.empty() ? "" : "." + clean(take, kMaxBytes);
  for (std::size_t i = 1; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    const bool kept = c >= 0x80 || std::isalnum(c) != 0 || c == '-' || c == '_' || c == ' ';
    if (!kept) text[i] = '_';
  }
  return text;
}

// The log has what came before the end of a take after its next commit.
constexpr std::chrono::milliseconds kCommitted{1000};

Result<> write_clip(Result<clip::Clip> clip, const std::filesystem::path& path) {
  if (!clip) return std::unexpected(clip.error());
  std::error_code error;
  if (std::filesystem::exists(path, error)) return fail("exists already", path.string());
  never_replace(path);
  clip::hold_missing(*clip);
  clip::hold_gaps(*clip);
  for (const std::string& warning : clip->warnings) {
    spdlog::warn("{}: {}", path.string(), warning);
  }
  TRY(clip::write_bvh(*clip, path));
  spdlog::info("wrote {}: {} frames", path.string(), clip->frames());
  return {};
}

bool end_signal_came() {
  const sigset_t signals = end_signals();
  constexpr timespec kAtOnce{};
  return sigtimedwait(&signals, nullptr, &kAtOnce) > 0;
}

TakeClips::TakeClips(std::filesystem::path log)
    : log_(std::move(log)), thread_([this](const std::stop_token& stop) { run(stop); }) {}

void TakeClips::take_changed() {
  {
    const std::scoped_lock lock(mutex_);
    changed_ = true;
  }
  wake_.notify_all();
}

void TakeClips::run(const std::stop_token& stop) {
  system::name_thread("posed-clips");
  system::give_way();
  while (!stop.stop_requested()) {
    std::unique_lock lock(mutex_);
    wake_.wait(lock, stop, [this] { return changed_; });
    changed_ = false;
    wake_.wait_for(lock, stop, kCommitted, [] { return false; });
    lock.unlock();
    if (stop.stop_requested()) return;
    if (auto done = write(false, stop); !done && !stop.stop_requested()) {
      spdlog::warn("clips of takes are written when posed ends: {}", done.error().text());
    }
  }
}

void TakeClips::stop() {
  thread_.request_stop();
  thread_.join();
}

Result<> TakeClips::finish() { return write(true, {}); }

// A clip that cannot be written is a warning; the log is not changed.
Result<> TakeClips::write(bool all, const std::stop_token& stop) {
  const std::string stem = (log_.parent_path() / log_.stem()).string();
  const auto each = [&](const log::TakeRow& take, const std::string& stream,
                        Result<clip::Clip> clip) {
    if (!all && take.last_item == log::kToTheEnd) return;
    if (!written_.emplace(take.id, stream).second) return;
    const std::string path =
        stem + "-" + std::to_string(take.id) + "-" + stream + ending_named(take.name) + ".bvh";
    if (auto written = write_clip(std::move(clip), path); !written) {
      spdlog::warn("take {} of stream {} is no clip: {}", take.id, stream, written.error().text());
    }
  };
  // During the run the signals are for who serves.
  const auto goes_on = [&] { return all ? !end_signal_came() : !stop.stop_requested(); };
  return each_take_clip(log_, each, goes_on);
}

}  // namespace

Result<> stream_and_record(const RecordingPlan& plan, const config::DaemonConfig& config) {
  if (!plan.out.empty()) {
    TRY(check_out(plan, config));
  }
  auto opened = TRY(assembly::Daemon::open(config));
  assembly::Daemon& daemon = *opened;
  TRY(check_end(daemon, plan.serve));
  auto started = std::make_shared<std::atomic<bool>>(false);
  auto replaced = TRY(SetAside::move(plan.overwrite ? plan.out : ""));
  const auto name = plan.out.empty() ? new_log(plan.folder) : LogName{plan.out};
  if (!name) return std::unexpected(name.error());
  std::unique_ptr<TakeClips> clips;
  if (plan.clips) clips = std::make_unique<TakeClips>(name->path);
  record::RecorderOptions recorder_options{
      .file = name->path,
      .reserved = name->reserved,
      .may_begin_later = plan.out.empty(),
      .frames = plan.frames,
      .config_text = config.text,
      .publish_endpoint = config.publish_endpoint,
      .clock = system::monotonic_ns,
      .report = [&daemon, &clips, started](const record::RecorderEvent& event) {
        if (*started) post(daemon, event);
        if (clips && event.kind == record::RecorderEvent::Kind::kTake) clips->take_changed();
      }};
  std::set<std::uint32_t> with_body;  // sources, by number
  auto recorder = TRY(record::Recorder::open(
      std::move(recorder_options), record::recorded_setup(daemon.sources(), daemon.slots())));
  assembly::DaemonHooks hooks;
  hooks.record_sink = &recorder->record_sink();
  hooks.record_stream = [&recorder, &with_body](const devices::NewStream& stream) {
    with_body.insert(stream.source.number);
    recorder->add_stream(record::recorded_stream(stream));
  };
  hooks.more_stats = [&recorder](v1::Stats& stats) {
    stats.set_recorder_lost_chunks(recorder->lost_chunks());
    stats.set_recorder_errors(recorder->errors());
    stats.set_recorder_file(clean(recorder->file().string()));
    stats.set_recorder_trouble(clean(recorder->trouble()));
    if (const auto take = recorder->running_take()) {
      *stats.mutable_take() = pipeline::stats_of(*take);
    }
  };
  hooks.recorder_figures = [&recorder] { return figures_of(*recorder); };
  if (auto done = daemon.start(std::move(hooks)); !done) {
    daemon.stop();
    // The error is what failed at the start, not what follows from it.
    [[maybe_unused]] const auto closed = recorder->finish();
    for (const char* suffix : log::kFileSuffixes) {  // nothing was recorded
      std::error_code ignored;
      std::filesystem::remove(name->path.string() + suffix, ignored);
    }
    return done;
  }
  replaced.release();
  *started = true;
  print_ready(daemon);
  const std::int64_t start_ns = system::monotonic_ns();
  serve(daemon, plan.serve,
        {{.thread = record::Recorder::kThreadName, .pulse = &recorder->pulse()}});
  const double took_s = seconds(system::monotonic_ns() - start_ns);
  if (clips) clips->stop();
  auto finished = recorder->finish();
  for (const auto& source : daemon.sources()) {
    if (!with_body.contains(source->number)) warn_of_no_body(source->config.name);
  }
  print_result(plan, daemon, *recorder, took_s);
  if (finished && clips) return clips->finish();
  return finished;
}

}  // namespace posed::tools
