#include "daemon/tools/mpi/mpi_ranks.hpp"

#include <mpi.h>
#include <sched.h>

#include <algorithm>
#include <chrono>
#include <numeric>
#include <sstream>
#include <thread>
#include <utility>

#include <gnu/libc-version.h>

#include "daemon/logging/log_output.hpp"
#include "proto/frame/whole_file.hpp"
#include "proto/log/digest.hpp"

namespace posed::mpi {
namespace {

constexpr std::chrono::milliseconds kLook{1};  // MPI's own waiting keeps a core busy

}  // namespace

// MPI's errors end the process (its default), so no call's return value is looked at.
Link::Link() {
  const HeldSignals held;  // MPI's threads begin here and leave signals to those that can hold them
  int threads = 0;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &threads);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  int size = 0;
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  std::string own(MPI_MAX_PROCESSOR_NAME, '\0');
  int length = 0;
  MPI_Get_processor_name(own.data(), &length);
  std::string all(own.size() * static_cast<std::size_t>(size), '\0');
  MPI_Allgather(own.data(), MPI_MAX_PROCESSOR_NAME, MPI_CHAR, all.data(), MPI_MAX_PROCESSOR_NAME,
                MPI_CHAR, MPI_COMM_WORLD);
  for (std::size_t at = 0; at < all.size(); at += own.size()) hosts_.emplace_back(&all[at]);
}

Link::~Link() { MPI_Finalize(); }

std::string Link::name(int rank) const {
  return "rank " + std::to_string(rank) + " on " + hosts_[rank];
}

int Link::ranks_here() const { return static_cast<int>(std::ranges::count(hosts_, hosts_[rank_])); }

void Link::send(int to, Kind kind, std::span<const std::byte> bytes) {
  MPI_Send(bytes.data(), static_cast<int>(bytes.size()), MPI_BYTE, to, static_cast<int>(kind),
           MPI_COMM_WORLD);
}

std::optional<Message> Link::poll() {
  int there = 0;
  MPI_Status status{};
  MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_WORLD, &there, &status);
  if (there == 0) return std::nullopt;
  int size = 0;
  MPI_Get_count(&status, MPI_BYTE, &size);
  Message message{status.MPI_SOURCE, static_cast<Kind>(status.MPI_TAG),
                  std::vector<std::byte>(size)};
  MPI_Recv(message.bytes.data(), size, MPI_BYTE, status.MPI_SOURCE, status.MPI_TAG, MPI_COMM_WORLD,
           MPI_STATUS_IGNORE);
  return message;
}

Message Link::next() {
  while (true) {
    if (auto message = poll()) return std::move(*message);
    std::this_thread::sleep_for(kLook);
  }
}

namespace {

constexpr int kLeaderRank = 0;
constexpr std::chrono::milliseconds kPause{1};
constexpr int kPausesPerReport = 100;  // progress is for people

std::unexpected<Error> ended() { return fail("the ranks have ended"); }

}  // namespace

volatile std::sig_atomic_t g_model_written = 0;

unsigned threads_here(const Link& link) {
  cpu_set_t bound;
  CPU_ZERO(&bound);
  sched_getaffinity(0, sizeof bound, &bound);
  const unsigned share =
      std::thread::hardware_concurrency() / static_cast<unsigned>(link.ranks_here());
  return std::clamp(share, 1U, std::max(1U, static_cast<unsigned>(CPU_COUNT(&bound))));
}

MpiRanks::MpiRanks(Link& link, std::string command_line)
    : link_(link), command_line_(std::move(command_line)), threads_(threads_here(link)) {}

// Beside the files, what decides on the last bits: the program itself, and the C library, whose
// sine and exponential have fused multiply-adds where the CPU has them.
std::vector<MpiRanks::Fact> MpiRanks::facts_of(
    const std::vector<std::filesystem::path>& inputs) const {
  std::vector<Fact> facts{
      {"command line", command_line_},
      {"build of posed-mpi", log::sha256_of_file("/proc/self/exe").value_or("")},
      {"C library", gnu_get_libc_version()},
      {"kind of CPU (fused multiply-add)", __builtin_cpu_supports("fma") != 0 ? "yes" : "no"}};
  for (const auto& input : inputs) {
    facts.push_back({input.string(), log::sha256_of_file(input).value_or("")});
  }
  return facts;
}

std::optional<std::vector<TaskResult>> MpiRanks::run_share(std::size_t count, const Task& task,
                                                           const TaskProgress& progress) {
  const std::size_t ranks = link_.size();
  const std::size_t own = link_.rank();
  const std::size_t share = (count + ranks - 1 - own) / ranks;
  return threads_.run(share, [&](std::size_t i) { return task(i * ranks + own); }, progress);
}

Result<> Leader::check_same(const std::vector<std::filesystem::path>& inputs) {
  std::string text;
  for (const Fact& fact : facts_of(inputs)) text += fact.value + '\n';
  send_all(Kind::kInputs, std::as_bytes(std::span(text)));
  while (answers(Kind::kCompared) + 1 < done_.size()) {
    const bool all_here = listen();
    TRY(compared());
    if (!all_here) return fail(loss_);
    std::this_thread::sleep_for(kPause);
  }
  auto same = compared();
  // A fast rank's results of the first tasks may be here before a slow one's answer.
  std::erase_if(came_, [](const Message& message) { return message.kind == Kind::kCompared; });
  return same;
}

Result<> Leader::compared() const {
  const auto other = std::ranges::find_if(came_, [](const Message& message) {
    return message.kind == Kind::kCompared && !message.bytes.empty();
  });
  if (other == came_.end()) return {};
  return fail(link().name(other->from) + std::string(other->text()) +
              "; give every rank the same program, command line and files");
}

Result<> Follower::check_same(const std::vector<std::filesystem::path>& inputs) {
  const auto facts = facts_of(inputs);
  const auto leaders = order();
  if (!leaders) return ended();
  std::istringstream text{std::string(leaders->text())};
  std::string difference;
  for (const Fact& fact : facts) {
    std::string value;
    if (!std::getline(text, value)) value.clear();
    if (value == fact.value) continue;
    difference = fact.value.empty() ? " cannot read " + fact.what + ", which rank 0 reads"
                 : value.empty()    ? " reads " + fact.what + ", which rank 0 cannot read"
                                    : " has another " + fact.what + " than rank 0";
    break;
  }
  link().send(kLeaderRank, Kind::kCompared, difference);
  if (!difference.empty()) return ended();
  return {};
}

void Leader::send_all(Kind kind, std::span<const std::byte> bytes) {
  for (int rank = 1; rank < link().size(); ++rank) link().send(rank, kind, bytes);
}

void Leader::stop() {
  if (!stopped_) send_all(Kind::kStop);
  stopped_ = true;
}

std::size_t Leader::answers(Kind kind) const {
  return std::ranges::count(came_, kind, &Message::kind);
}

bool Leader::listen() {
  while (auto message = link().poll()) {
    if (message->kind == Kind::kDone) {
      done_[message->from] = std::stoul(std::string(message->text()));
    } else if (message->kind == Kind::kLeft) {
      ++left_;
      if (loss_.empty()) {
        loss_ = link().name(message->from) + " has ended: " + std::string(message->text());
      }
    } else {
      came_.push_back(std::move(*message));
    }
  }
  return left_ == 0;
}

std::optional<std::vector<TaskResult>> Leader::run(std::size_t count, const Task& task,
                                                   const TaskProgress& progress) {
  if (stopped_) return std::nullopt;
  std::ranges::fill(done_, 0U);
  const TaskProgress report_progress = [&](std::size_t done) {
    done_.front() = done;
    if (!listen()) return false;
    const auto all = std::accumulate(done_.begin(), done_.end(), std::size_t{0});
    return !progress || progress(all);
  };
  auto own = run_share(count, task, report_progress);
  for (int look = 1; own && answers(Kind::kResults) + 1 < done_.size(); ++look) {
    std::this_thread::sleep_for(kPause);
    const bool go_on = look % kPausesPerReport == 0 ? report_progress(done_.front()) : listen();
    if (!go_on) own.reset();
  }
  if (!own) {
    if (!loss_.empty()) logging::say("posed-mpi: " + loss_);
    stop();
    return std::nullopt;
  }
  std::vector<TaskResult> results(count);
  const auto place = [&](std::vector<TaskResult> part, std::size_t rank) {
    for (std::size_t i = 0; i < part.size(); ++i)
      results[i * done_.size() + rank] = std::move(part[i]);
  };
  place(std::move(*own), 0);
  for (const Message& message : came_) {
    place(unpacked(message.bytes), static_cast<std::size_t>(message.from));
  }
  came_.clear();
  const auto numbers = packed(results);
  send_all(Kind::kAll, std::as_bytes(std::span(numbers)));
  return results;
}

void Leader::leave(const std::string& /*message*/) {
  stop();
  while (left_ + 1 < link().size()) {
    static_cast<void>(listen());
    std::this_thread::sleep_for(kPause);
  }
}

std::optional<Message> Follower::order() {
  if (stopped_) return std::nullopt;
  Message message = link().next();
  stopped_ = message.kind == Kind::kStop;
  if (stopped_) return std::nullopt;
  return message;
}

std::optional<std::vector<TaskResult>> Follower::run(std::size_t count, const Task& task,
                                                     const TaskProgress& /*progress*/) {
  if (stopped_) return std::nullopt;
  std::size_t reported = 0;
  const auto own = run_share(count, task, [&](std::size_t done) {
    if (done != reported) link().send(kLeaderRank, Kind::kDone, std::to_string(done));
    reported = done;
    // While tasks run, the leader says nothing but to stop.
    stopped_ = stopped_ || link().poll().has_value();
    return !stopped_;
  });
  if (!own) return std::nullopt;
  const auto numbers = packed(*own);
  link().send(kLeaderRank, Kind::kResults, std::as_bytes(std::span(numbers)));
  const auto all = order();
  if (!all) return std::nullopt;
  return unpacked(all->bytes);
}

void Follower::leave(const std::string& message) {
  link().send(kLeaderRank, Kind::kLeft, message);
  while (!stopped_) static_cast<void>(order());
}

}  // namespace posed::mpi
