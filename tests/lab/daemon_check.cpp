#include "tests/lab/daemon_check.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <functional>
#include <map>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/lab/gadget.hpp"
#include "tests/lab/judge.hpp"
#include "tests/lab/listener.hpp"
#include "tests/lab/resources.hpp"
#include "tests/lab/speaker.hpp"
#include "tests/support/process.hpp"

namespace posed::lab {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using Speakers = std::vector<std::unique_ptr<Speaker>>;

constexpr int kRounds = 10;
constexpr std::size_t kSamplesARound = 60;
constexpr auto kUnplugged = 100ms;  // after posed has reported that the glove is gone
constexpr auto kPatience =
    15s;  // timeout of the lab; measured times are printed and judged separately
constexpr const char* kConfig = "/tmp/lab.toml";

bool wait_until(const std::function<bool()>& what) {
  const auto deadline = Clock::now() + kPatience;
  while (!what()) {
    if (Clock::now() > deadline) return false;
    std::this_thread::sleep_for(5ms);
  }
  return true;
}

// Runs posed with all gloves, unplugs and plugs them, and records what a client receives.
class DaemonCheck {
 public:
  explicit DaemonCheck(Speakers speakers)
      : speakers_(std::move(speakers)), listener_(start_daemon()) {}

  [[nodiscard]] int run() {
    const bool streaming =
        std::ranges::all_of(speakers_, [&](const auto& glove) { return speaks(*glove, Moment{}); });
    Resources before;
    for (int round = 0; round < kRounds && streaming && trouble_.empty(); ++round) {
      for (const auto& glove : speakers_) replug(*glove);
      // The first replug touches code and heap pages for the first time, so memory is compared from
      // then on.
      if (round == 0) before = Resources::of(std::to_string(daemon_->pid()));
    }
    const Resources after = Resources::of(std::to_string(daemon_->pid()));
    int failed = check_resources(before, after) ? 0 : 1;
    for (const auto& glove : speakers_) failed += check(*glove) ? 0 : 1;
    std::printf("%s\nposed says: %s\n", trouble_.c_str(), daemon_->errors().c_str());
    // A speaker may block until the host reads; without a plug it does not block.
    for (const auto& glove : speakers_) glove->device().unplug();
    return failed;
  }

 private:
  std::string start_daemon() {
    std::ofstream config(kConfig);
    config << "realtime = false\n[publish]\nendpoint = \"tcp://127.0.0.1:*\"\n"
              "[control]\nendpoint = \"tcp://127.0.0.1:*\"\n";
    for (const auto& speaker : speakers_) {
      const Glove& glove = speaker->glove();
      config << "[[stream]]\nname = \"" << glove.device << "\"\ndriver = \"" << glove.driver
             << "\"\n"
             << glove.config;
    }
    config.close();
    daemon_.emplace(std::vector<std::string>{"run", "--config", kConfig});
    const auto line = daemon_->line();
    if (!line) give_up("posed does not start: " + daemon_->errors());
    return nlohmann::json::parse(*line).at("publish");
  }

  bool speaks(const Speaker& glove, Moment since) {
    return wait_until(
        [&] { return listener_.samples_since(glove.name(), since) > kSamplesARound; });
  }

  void replug(Speaker& glove) {
    const LabDevice& device = glove.device();
    Replug replug{.unplugged = Clock::now(), .plugged = {}, .node = {}};
    device.unplug();
    const auto reported = [&] { return listener_.lost_since(glove.name(), replug.unplugged); };
    if (!wait_until(reported)) trouble_ += glove.name() + ": unplugged, and posed does not tell; ";
    std::this_thread::sleep_for(kUnplugged);
    replug.plugged = Clock::now();
    device.plug();
    if (!speaks(glove, replug.plugged)) trouble_ += glove.name() + ": too little after a replug; ";
    const auto node = device.there_since();
    if (!node) trouble_ += glove.name() + ": the kernel does not find it again; ";
    replug.node = node.value_or(replug.plugged);
    replugs_[glove.name()].push_back(replug);
  }

  bool check(const Speaker& glove) {
    const Verdict verdict = judge(listener_.received(glove.name()), glove.said(),
                                  glove.glove().modulus, replugs_[glove.name()]);
    const bool good = verdict.good() && trouble_.empty();
    std::printf("%s posed %s: %zu replugs, %s\n", good ? "ok  " : "FAIL", glove.name().c_str(),
                replugs_[glove.name()].size(), verdict.text().c_str());
    return good;
  }

  static bool check_resources(const Resources& before, const Resources& after) {
    const bool good = after.descriptors == before.descriptors &&
                      after.memory_kb <= before.memory_kb + kMemorySlack_kb;
    std::printf("%s posed after all replugs: descriptors %ld -> %ld, memory %ld -> %ld KB\n",
                good ? "ok  " : "FAIL", before.descriptors, after.descriptors, before.memory_kb,
                after.memory_kb);
    return good;
  }

  Speakers speakers_;
  std::optional<test::Process> daemon_;
  Listener listener_;
  std::map<std::string, std::vector<Replug>> replugs_;
  std::string trouble_;
};

}  // namespace

int check_daemon(const LabDevices& devices) {
  Speakers speakers;
  for (Glove& glove : gloves()) {
    auto& device = **std::ranges::find(devices, glove.device, &LabDevice::name);
    device.plug();
    speakers.push_back(std::make_unique<Speaker>(device, std::move(glove)));
  }
  return DaemonCheck(std::move(speakers)).run();
}

}  // namespace posed::lab
