#include "tests/lab/judge.hpp"

#include <algorithm>
#include <chrono>
#include <optional>

namespace posed::lab {
namespace {

using namespace std::chrono_literals;

constexpr auto kMaxReturn = 1s;  // from the plug
constexpr auto kMaxOpening =
    400ms;  // from the node: the supervisor's polling interval without a hotplug event
constexpr auto kMaxSilence = 200ms;  // ten reports
constexpr auto kUnderWay = 30ms;     // from the glove to the daemon

// The number of the last report with this value that was sent before the sample arrived.
std::size_t number_of(const ReceivedSample& sample, const std::vector<Moment>& said,
                      std::uint32_t modulus) {
  const auto later = std::upper_bound(said.begin() + 1, said.end(), sample.arrived);
  auto n = static_cast<std::size_t>(later - said.begin()) - 1;
  while (n > 0 && n % modulus != *sample.value) --n;
  return n;
}

// One glove's samples in order of arrival, session by session.
class Judge {
 public:
  Judge(const Received& received, const std::vector<Moment>& said, std::uint32_t modulus,
        const std::vector<Replug>& replugs)
      : received_(received), said_(said), modulus_(modulus), replugs_(replugs) {}

  Verdict judge() {
    for (const ReceivedSample& sample : received_.samples) take(sample);
    verdict_.samples = received_.samples.size();
    if (session_ < replugs_.size()) say("no frame came after replug " + number(session_ + 1));
    return verdict_;
  }

 private:
  void take(const ReceivedSample& sample) {
    if (last_ && sample.sequence != last_->sequence + 1) ++verdict_.gaps;
    const auto begun = std::ranges::upper_bound(replugs_, sample.arrived, {}, &Replug::plugged);
    const auto session = static_cast<std::size_t>(begun - replugs_.begin());
    const bool follows = last_ && session == session_;
    if (follows) verdict_.silence = std::max(verdict_.silence, sample.arrived - last_->arrived);
    last_ = sample;
    if (!sample.value) {
      ++verdict_.mixed;
      return;
    }
    const std::size_t n = number_of(sample, said_, modulus_);
    if (follows && n != report_ + 1) {
      ++verdict_.skipped;
      say("after report " + number(report_) + " came " + number(n));
    }
    if (!follows && session > 0) begin(session, n, sample);
    session_ = session;
    report_ = n;
  }

  void begin(std::size_t session, std::size_t first, const ReceivedSample& sample) {
    if (session != session_ + 1) say("no frame came after replug " + number(session_ + 1));
    const Replug& replug = replugs_[session - 1];
    verdict_.back = std::max(verdict_.back, sample.received - replug.node);
    verdict_.since_plug = std::max(verdict_.since_plug, sample.received - replug.plugged);
    const auto found = std::ranges::upper_bound(received_.found, replug.plugged);
    if (found == received_.found.end()) return say("posed did not tell that it found the glove");
    if (first <= report_) return say("report " + number(first) + " came twice");
    const std::size_t lost = first - report_ - 1;
    verdict_.lost_a_replug = std::max<std::uint64_t>(verdict_.lost_a_replug, lost);
    if (lost == 0) return;
    if (said_[first - 1] > *found) ++verdict_.ours;
    if (said_[report_ + 1] < replug.unplugged - kUnderWay) ++verdict_.cut_early;
  }

  static std::string number(std::size_t n) { return std::to_string(n); }
  void say(const std::string& what) {
    verdict_.problems += (verdict_.problems.empty() ? "" : ", ") + what;
  }

  const Received& received_;
  const std::vector<Moment>& said_;
  std::uint32_t modulus_;
  const std::vector<Replug>& replugs_;
  Verdict verdict_;
  std::optional<ReceivedSample> last_;
  std::size_t session_ = 0;  // of the last sample
  std::size_t report_ = 0;   // the last known report
};

}  // namespace

bool Verdict::good() const {
  return problems.empty() && mixed == 0 && skipped == 0 && gaps == 0 && ours == 0 &&
         cut_early == 0 && back < kMaxOpening && since_plug < kMaxReturn && silence < kMaxSilence;
}

std::string Verdict::text() const {
  const auto ms = [](auto time) {
    return std::to_string(std::chrono::duration_cast<std::chrono::milliseconds>(time).count());
  };
  const auto count = [](std::uint64_t n, const char* what) {
    return std::to_string(n) + " " + what + ", ";
  };
  return count(samples, "samples") + count(mixed, "mixed") + count(skipped, "holes") +
         count(gaps, "gaps") + count(ours, "late starts") + count(cut_early, "early ends") +
         count(lost_a_replug, "reports lost a replug at most") + "back " + ms(back) +
         " ms after the node and " + ms(since_plug) + " ms after the plug, silent for " +
         ms(silence) + " ms at most" + (problems.empty() ? "" : ": " + problems);
}

Verdict judge(const Received& received, const std::vector<Moment>& said, std::uint32_t modulus,
              const std::vector<Replug>& replugs) {
  return Judge(received, said, modulus, replugs).judge();
}

}  // namespace posed::lab
