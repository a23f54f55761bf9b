#include "daemon/tools/run/recording.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <ctime>
#include <memory>
#include <set>
#include <system_error>
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
#include "daemon/tools/run/take_clips.hpp"
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

void remove_log(const std::filesystem::path& file) {
  for (const char* suffix : log::kFileSuffixes) {
    std::error_code ignored;
    if (!file.empty()) std::filesystem::remove(file.string() + suffix, ignored);
  }
}

// Too little memory or too few threads end posed with an exception; then `file`, which is of this
// process, is removed, because nothing was recorded. Empty: none.
template <typename Start>
auto start_or_remove(const std::filesystem::path& file, const Start& start) {
  try {
    return start();
  } catch (...) {
    remove_log(file);
    throw;
  }
}

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

// What the daemon calls while it records. All arguments outlive it; `clips` may be null.
assembly::DaemonHooks hooks_of(record::Recorder& recorder, TakeClips* clips,
                               std::set<std::uint32_t>& sources_with_body) {
  assembly::DaemonHooks hooks;
  hooks.record_sink = &recorder.record_sink();
  hooks.record_stream = [&recorder, clips, &sources_with_body](const devices::NewStream& stream) {
    sources_with_body.insert(stream.source.number);
    if (clips != nullptr) {
      clips->stream_comes(stream.id, {.name = stream.config.name,
                                      .skeleton = stream.stages.published,
                                      .rate_hz = stream.stages.settings.rate_hz});
    }
    recorder.add_stream(record::recorded_stream(stream));
  };
  hooks.more_stats = [&recorder](v1::Stats& stats) {
    stats.set_recorder_lost_chunks(recorder.lost_chunks());
    stats.set_recorder_errors(recorder.errors());
    stats.set_recorder_file(clean(recorder.file().string()));
    stats.set_recorder_trouble(clean(recorder.trouble()));
    if (const auto take = recorder.running_take()) {
      *stats.mutable_take() = pipeline::stats_of(*take);
    }
  };
  hooks.recorder_figures = [&recorder] { return figures_of(recorder); };
  hooks.frame_tap = clips;
  if (clips != nullptr) {
    hooks.add_clips = [clips](v1::ControlReply& reply) { clips->add_to(reply); };
  }
  return hooks;
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
        if (clips && event.take) clips->take_changed(*event.take);
      }};
  std::set<std::uint32_t> with_body;  // sources, by number
  auto recorder = TRY(start_or_remove(name->reserved ? name->path : "", [&] {
    return record::Recorder::open(std::move(recorder_options),
                                  record::recorded_setup(daemon.sources(), daemon.slots()));
  }));
  // By now that of --out is of this process, too.
  const auto own_log = name->reserved || !plan.out.empty() ? name->path : "";
  assembly::DaemonHooks hooks = hooks_of(*recorder, clips.get(), with_body);
  if (auto done = start_or_remove(own_log, [&] { return daemon.start(std::move(hooks)); }); !done) {
    daemon.stop();
    // The error is what failed at the start, not what follows from it.
    [[maybe_unused]] const auto closed = recorder->finish();
    remove_log(own_log);
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
  const Result<> made = clips ? clips->finish() : Result<>();
  return finished ? made : finished;
}

}  // namespace posed::tools
