#include "daemon/tools/export/log_clip.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <ranges>
#include <utility>

#include "daemon/pipeline/take.hpp"
#include "daemon/tools/replay/replay.hpp"
#include "proto/frame/time.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/list.hpp"
#include "proto/text/stream_name.hpp"

namespace posed::tools {
namespace {

constexpr std::size_t kMaxListed = 20;  // takes in a sentence

std::string list_of(const std::vector<log::TakeRow>& takes) {
  std::string list;
  for (std::size_t i = 0; i < takes.size() && i < kMaxListed; ++i) {
    const pipeline::Take take{.number = static_cast<std::uint32_t>(takes[i].id),
                              .name = takes[i].name};
    add_word(list, pipeline::words_of(take));
  }
  if (takes.size() > kMaxListed) {
    list += " and " + std::to_string(takes.size() - kMaxListed) + " more";
  }
  return list;
}

// Finds between which items the chunks came that a log lacks, and marks the takes that were running
// then. A gap lies between two chunks of one source; the items in between are other sources'.
class GapMarker {
 public:
  GapMarker(const std::vector<log::GapRow>& gaps, std::vector<LoggedTake>& takes) : takes_(takes) {
    for (const log::GapRow& gap : gaps) {
      if (gap.kind != log::GapRow::Kind::kChunks) continue;
      if (gap.after_chunk == 0) {
        open_[gap.owner] = 0;
      } else {
        after_[gap.after_chunk] = gap.owner;
      }
    }
  }
  // In the order of the log.
  void on_chunk(const log::ChunkRow& row) {
    if (const auto open = open_.find(row.source); open != open_.end()) {
      mark(open->second, row.first_item);
      open_.erase(open);
    }
    if (after_.contains(row.id)) open_[row.source] = row.first_item;
  }
  void on_end() {
    for (const auto& [source, item] : open_) mark(item, log::kToTheEnd);
  }

 private:
  void mark(std::uint64_t before, std::uint64_t after) {
    for (LoggedTake& take : takes_) {
      const bool overlaps = take.row.first_item < after && take.row.last_item > before;
      if (overlaps) take.has_gaps = true;
    }
  }
  std::vector<LoggedTake>& takes_;
  std::map<std::int64_t, std::uint32_t> after_;  // chunk before a gap -> its source
  std::map<std::uint32_t, std::uint64_t> open_;  // source -> the last item before its gap
};

}  // namespace

void FrameCollector::add(const Frame& frame, const Timecode& timecode) {
  const Header& header = frame.header;
  if (timecode != Timecode{}) moment_ = timecode;
  if (part_ != header.stream) {
    if (last_ != 0) ++returns_;
    last_ = 0;
    part_ = header.stream;
  }
  if (header.sequence <= last_) return;  // repeated while the stream was stale
  missing_ += last_ == 0 ? 0 : header.sequence - last_ - 1;
  last_ = header.sequence;
  times_.add(header);
  clip_.add(frame, frame.timecode == Timecode{} ? moment_ : frame.timecode);
  moment_ = {};
}

Result<clip::Clip> FrameCollector::finish(const std::string& path, double rate_hz) const {
  auto clip = clip_.finish(path, rate_hz, times_.in_seconds());
  if (clip && missing_ > 0) {
    clip->warnings.push_back(std::to_string(missing_) +
                             " frames were skipped while the daemon ran");
  }
  if (clip && returns_ > 0) {
    clip->warnings.push_back("the body came back " + std::to_string(returns_) + " times");
  }
  return clip;
}

Result<log::TakeRow> find_take(const log::Reader& reader, const std::string& wanted) {
  auto takes = TRY(reader.takes());
  if (takes.empty()) return misuse("has no takes; leave --take out", reader.file());
  for (const log::TakeRow& take : takes) {
    if (std::to_string(take.id) == wanted) return take;
  }
  std::vector<log::TakeRow> named;
  std::ranges::copy_if(takes, std::back_inserter(named),
                       [&](const log::TakeRow& take) { return take.name == wanted; });
  if (named.size() == 1) return named.front();
  if (named.empty()) {
    return misuse("has no take " + in_quotes(wanted) + ", but " + list_of(takes), reader.file());
  }
  return misuse("has several takes named " + in_quotes(wanted) +
                    "; give the number of one: " + list_of(named),
                reader.file());
}

Result<std::vector<LoggedTake>> logged_takes(log::Reader& reader) {
  auto rows = TRY(reader.takes());
  std::vector<LoggedTake> takes;
  takes.reserve(rows.size());
  for (log::TakeRow& row : rows) takes.push_back({.row = std::move(row)});
  const auto extent = TRY(reader.extent());
  if (takes.empty() || !extent) return takes;
  const auto gaps = TRY(reader.gaps());
  GapMarker gap_marker(gaps, takes);
  for (auto chunk = reader.next_chunk();; chunk = reader.next_chunk()) {
    if (!chunk) return std::unexpected(chunk.error());
    if (!chunk->has_value()) break;
    const log::ChunkRow& row = **chunk;
    gap_marker.on_chunk(row);
    if (row.direction != 0) continue;  // the others have no time of their own
    const double time_s = seconds(row.arrival_ns - extent->first_ns);
    for (LoggedTake& take : takes) {
      if (!holds(take.row, row.first_item)) continue;
      if (!take.begin_s) take.begin_s = time_s;
      take.end_s = time_s;
    }
  }
  gap_marker.on_end();
  return takes;
}

namespace {

// The streams of one name, in the order in which they came.
using Parts = std::vector<std::uint32_t>;

// Only streams with a skeleton, because others have no pose.
std::map<std::string, Parts> parts_by_name(const replay::Replay& replay) {
  std::map<std::string, Parts> parts;
  for (std::uint32_t id = 0; id < replay.streams(); ++id) {
    const replay::ReplayStream& stream = replay.stream(id);
    if (stream.published != nullptr) parts[stream.name].push_back(id);
  }
  const auto first_item = [&](std::uint32_t id) { return replay.stream(id).first_item; };
  for (auto& [name, ids] : parts) std::ranges::stable_sort(ids, {}, first_item);
  return parts;
}

// Of the frames that the stream published, or of its unstyled ones.
std::shared_ptr<const Skeleton> skeleton_of(const replay::Replay& replay, std::uint32_t id,
                                            bool raw) {
  const replay::ReplayStream& stream = replay.stream(id);
  return raw ? stream.description.skeleton : stream.published;
}

// The part that "walker#2" names; empty if there is none.
Parts part_named(const std::map<std::string, Parts>& parts, const std::string& wanted) {
  for (const auto& [name, ids] : parts) {
    for (std::size_t i = 0; i < ids.size(); ++i) {
      if (wanted == name + "#" + std::to_string(i + 1)) return {ids[i]};
    }
  }
  return {};
}

// A clip has one skeleton.
Result<> check_same_skeleton(const replay::Replay& replay, const std::string& name,
                             const Parts& ids, const std::string& path, bool raw = false) {
  const auto id_of = [&](std::uint32_t id) { return skeleton_of(replay, id, raw)->id; };
  const auto differs = [&](std::uint32_t id) { return id_of(id) != id_of(ids.front()); };
  if (std::ranges::none_of(ids, differs)) return {};
  std::string list;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    add_word(list, name + "#" + std::to_string(i + 1) + " (" +
                       std::to_string(skeleton_of(replay, ids[i], raw)->joints.size()) +
                       " joints)");
  }
  return misuse("stream " + in_quotes(name) +
                    " changed its skeleton, so its parts are clips of their own; name one by"
                    " --stream: " +
                    list,
                path);
}

// The streams that become one clip.
struct Chosen {
  Parts ids;
  bool raw = false;  // the unstyled frames of them
};

Result<Chosen> choose(const replay::Replay& replay, const std::string& wanted, bool wants_raw,
                      const std::string& path) {
  const auto parts = parts_by_name(replay);
  if (parts.empty()) return fail("has no stream with a skeleton", path);
  const std::string names = joined(std::views::keys(parts));
  const bool says_raw = wanted.ends_with(kRawSuffix) && !parts.contains(wanted);
  const bool raw = wants_raw || says_raw;
  const std::string stream =
      says_raw ? wanted.substr(0, wanted.size() - kRawSuffix.size()) : wanted;
  if (stream.empty() && parts.size() > 1) {
    return misuse("has the streams " + names + "; name one by --stream", path);
  }
  const auto found = stream.empty() ? parts.begin() : parts.find(stream);
  Chosen chosen{.ids = found == parts.end() ? part_named(parts, stream) : found->second,
                .raw = raw};
  if (chosen.ids.empty()) {
    return misuse("has no stream " + in_quotes(stream) + " with a skeleton, but " + names, path);
  }
  const std::string& name = replay.stream(chosen.ids.front()).name;
  TRY(check_same_skeleton(replay, name, chosen.ids, path, raw));
  return chosen;
}

// The timecodes that a trigger told of the beginnings of takes: each for the first frame behind it.
class TakeStarts {
 public:
  explicit TakeStarts(std::vector<log::TakeRow> takes) : takes_(std::move(takes)) {}

  Timecode at(std::uint64_t item) {
    Timecode timecode{};
    for (; next_ < takes_.size() && item >= takes_[next_].first_item; ++next_) {
      timecode = holds(takes_[next_], item) ? to_timecode(takes_[next_].timecode) : Timecode{};
    }
    return timecode;
  }

 private:
  std::vector<log::TakeRow> takes_;  // in their order
  std::size_t next_ = 0;
};

// By stream, the name of its clip: that of the stream, or "walker#2" if its skeleton changes.
std::map<std::uint32_t, std::string> clip_names(const replay::Replay& replay) {
  std::map<std::uint32_t, std::string> names;
  for (const auto& [name, ids] : parts_by_name(replay)) {
    const bool one = check_same_skeleton(replay, name, ids, {}).has_value();
    for (std::size_t i = 0; i < ids.size(); ++i) {
      names[ids[i]] = one ? name : name + "#" + std::to_string(i + 1);
    }
  }
  return names;
}

// Collects the frames of one take.
class TakeCollector {
 public:
  TakeCollector(const replay::Replay& replay, log::TakeRow take)
      : replay_(replay), take_(std::move(take)), names_(clip_names(replay)) {}

  void add(const pipeline::Item& item) {
    if (item.kind != pipeline::Item::Kind::kFrame || !holds(take_, replay_.position())) return;
    const auto name = names_.find(item.frame.header.stream);
    if (name == names_.end()) return;
    collectors_.try_emplace(name->second, replay_.stream(name->first).published)
        .first->second.add(item.frame);
    rate_hz_[name->second] = replay_.stream(name->first).description.rate_hz;
  }
  void finish(const std::string& file, const EachClip& each) const {
    for (const auto& [name, collector] : collectors_) {
      if (collector.frames() < 2) continue;  // no clip
      each(name, collector.finish(file, rate_hz_.at(name)));
    }
  }

 private:
  const replay::Replay& replay_;
  log::TakeRow take_;
  std::map<std::uint32_t, std::string> names_;  // of the clips, by stream
  std::map<std::string, FrameCollector> collectors_;
  std::map<std::string, double> rate_hz_;  // as collectors_
};

}  // namespace

Result<> check_log_options(const std::string& in, bool part_given, const clip::ReadOptions& read) {
  if (!is_log(in)) {
    if (!part_given) return {};
    return misuse("is not a device log (.plog), so --stream and --take have no effect", in);
  }
  const bool figure_given = !read.skeleton.empty() || !read.profile.empty() || read.rate_hz ||
                            read.metres_per_unit || read.up || read.facing;
  if (!figure_given) return {};
  return misuse("is a device log (.plog), which says its skeleton, rate and unit; leave them out",
                in);
}

Result<clip::Clip> clip_of_log(const std::filesystem::path& path, const std::string& stream,
                               const std::string& wanted_take, bool raw) {
  auto reader = TRY(log::Reader::open(path));
  log::TakeRow interval{.name = {}, .last_item = log::kToTheEnd};
  if (!wanted_take.empty()) {
    interval = TRY(find_take(reader, wanted_take));
  }
  auto opened = TRY(replay::Replay::open(reader, raw || stream.ends_with(kRawSuffix)));
  replay::Replay& replay = *opened;
  const auto chosen = TRY(choose(replay, stream, raw, path.string()));
  const replay::ReplayStream& first = replay.stream(chosen.ids.front());
  FrameCollector collector(skeleton_of(replay, chosen.ids.front(), chosen.raw));
  const auto kind = chosen.raw ? pipeline::Item::Kind::kRawFrame : pipeline::Item::Kind::kFrame;
  std::vector<log::TakeRow> takes{interval};
  if (wanted_take.empty()) takes = TRY(reader.takes());
  TakeStarts starts(std::move(takes));
  const auto take = [&](const pipeline::Item& item) {
    if (item.kind == kind && holds(interval, replay.position()) &&
        std::ranges::find(chosen.ids, item.frame.header.stream) != chosen.ids.end()) {
      collector.add(item.frame, starts.at(replay.position()));
    }
  };
  TRY(replay.run(take,
                 [&](const log::ChunkRow&) { return replay.position() <= interval.last_item; }));
  if (!wanted_take.empty() && collector.frames() < 2) {
    return fail("take " + std::to_string(interval.id) + " has " +
                    std::to_string(collector.frames()) + " frames of stream " +
                    in_quotes(first.name) + ", and a clip needs two",
                path.string());
  }
  auto clip = TRY(collector.finish(path.string(), first.description.rate_hz));
  for (const std::uint32_t id : chosen.ids) {
    const auto broken = replay.broken_at(id);
    if (!broken) continue;
    clip.warnings.push_back("the log is known to lack data from frame " + std::to_string(*broken) +
                            " on");
    break;
  }
  return clip;
}

Result<> each_clip_of_take(const std::filesystem::path& path, const log::TakeRow& take,
                           const EachClip& each, const std::function<bool()>& goes_on) {
  auto reader = TRY(log::Reader::open(path));
  const auto rows = TRY(reader.takes());
  const auto row = std::ranges::find(rows, take.id, &log::TakeRow::id);
  const bool is_there =
      row != rows.end() && (take.last_item == log::kToTheEnd || row->last_item == take.last_item);
  if (!is_there) {
    return fail("the log does not have the end of take " + std::to_string(take.id) + " yet",
                path.string());
  }
  auto opened = TRY(replay::Replay::open(reader));
  TakeCollector collector(*opened, *row);
  bool stopped = false;
  TRY(opened->run([&](const pipeline::Item& item) { collector.add(item); },
                  [&](const log::ChunkRow&) {
                    stopped = stopped || !goes_on();
                    return !stopped && opened->position() <= row->last_item;
                  }));
  if (stopped) return fail("interrupted: the log is complete, but not all of its takes are clips");
  collector.finish(path.string(), each);
  return {};
}

}  // namespace posed::tools
