// posed as a service of systemd: what it tells on NOTIFY_SOCKET, and that it falls silent when any
// one of its threads stands still.
#include <catch2/catch.hpp>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <poll.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "tests/e2e/served.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/mocap_room.hpp"

namespace posed::test {
namespace {

using namespace std::chrono_literals;

constexpr auto kWithin = 2s;  // WATCHDOG_USEC

// The socket that systemd would give to a service.
class NotifySocket {
 public:
  explicit NotifySocket(const std::filesystem::path& path)
      : fd_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.string().copy(address.sun_path, sizeof address.sun_path - 1);
    REQUIRE(::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  }
  ~NotifySocket() { ::close(fd_); }
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;

  // The next message; nullopt when none comes in time.
  std::optional<std::string> message(std::chrono::milliseconds within = 30s) const {
    pollfd wait{fd_, POLLIN, 0};
    if (::poll(&wait, 1, static_cast<int>(within.count())) != 1) return {};
    std::string text(4096, '\0');
    const ssize_t size = ::recv(fd_, text.data(), text.size(), 0);
    text.resize(static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
    return text;
  }
  // Waits for a message that contains this.
  bool comes(const std::string& part, std::chrono::milliseconds within = 30s) const {
    const auto end = std::chrono::steady_clock::now() + within;
    while (true) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
          end - std::chrono::steady_clock::now());
      if (left <= 0ms) return false;
      const auto next = message(left);
      if (next && next->contains(part)) return true;
    }
  }
  // Forgets what has come so far.
  void forget() const {
    while (message(0ms)) {
    }
  }

 private:
  int fd_;
};

// A thread that stands still while this object lives; the others go on.
class StoppedThread {
 public:
  explicit StoppedThread(pid_t thread) : thread_(thread) {
    REQUIRE(::ptrace(PTRACE_SEIZE, thread_, nullptr, nullptr) == 0);
    REQUIRE(::ptrace(PTRACE_INTERRUPT, thread_, nullptr, nullptr) == 0);
    REQUIRE(::waitpid(thread_, nullptr, __WALL) == thread_);
  }
  ~StoppedThread() { ::ptrace(PTRACE_DETACH, thread_, nullptr, nullptr); }
  StoppedThread(const StoppedThread&) = delete;
  StoppedThread& operator=(const StoppedThread&) = delete;

 private:
  pid_t thread_;
};

// The thread of this name; -1 if there is none.
pid_t thread_named(pid_t process, const std::string& name) {
  const std::filesystem::path tasks = "/proc/" + std::to_string(process) + "/task";
  for (const auto& task : std::filesystem::directory_iterator(tasks)) {
    std::string comm;
    std::getline(std::ifstream(task.path() / "comm"), comm);
    if (comm == name) return std::stoi(task.path().filename().string());
  }
  return -1;
}

// A daemon with all kinds of threads, started as systemd does it.
struct ServiceStage {
  explicit ServiceStage(const std::string& command = "record", const std::string& config = {}) {
    REQUIRE(clip::write_bvh(toy_walk(240, 120.0), folder.path() / "walk.bvh"));
    folder.write("posed.toml",
                 !config.empty() ? config
                                 : std::string(Stage::kEndpoints) +
                                       "[trigger]\nlisten = \"127.0.0.1:0\"\n"
                                       "[metrics]\nlisten = \"127.0.0.1:0\"\n" +
                                       Stage::kWalker +
                                       "[[output]]\nkind = \"vmc\"\nbody = \"walker\"\n"
                                       "to = [\"127.0.0.1:9\"]\n"
                                       "[[source]]\nname = \"stage\"\ndriver = \"template_mocap\"\n"
                                       "streams = \"all\"\n[source.template_mocap]\n"
                                       "listen = \"127.0.0.1:0\"\n");
    const std::string socket_path = (folder.path() / "notify").string();
    const auto usec = std::chrono::duration_cast<std::chrono::microseconds>(kWithin).count();
    std::vector<std::string> words{"env",
                                   "NOTIFY_SOCKET=" + socket_path,
                                   "WATCHDOG_USEC=" + std::to_string(usec),
                                   posed_binary().string(),
                                   command,
                                   "--config",
                                   (folder.path() / "posed.toml").string()};
    if (command == "record") {
      words.insert(words.end(), {"--out", (folder.path() / "take.plog").string()});
    }
    daemon.emplace(Command(std::move(words)));
  }
  TempFolder folder;
  NotifySocket socket{folder.path() / "notify"};
  std::optional<Process> daemon;
};

TEST_CASE("a service counts the streams of bodies, and its first line names those of the config") {
  const std::uint16_t port = free_port();
  ServiceStage stage("run", std::string(Stage::kEndpoints) +
                                "[[source]]\nname = \"room\"\ndriver = \"template_mocap\"\n"
                                "streams = \"all\"\n[source.template_mocap]\n"
                                "listen = \"127.0.0.1:" +
                                std::to_string(port) +
                                "\"\n[[stream]]\nname = \"lead\"\nsource = \"room\"\n"
                                "body = \"Person 0\"\n");
  const auto line = stage.daemon->line();
  INFO(stage.daemon->errors());
  REQUIRE(line);
  CHECK(nlohmann::json::parse(*line).at("streams") == nlohmann::json::array({"lead"}));
  CHECK(stage.socket.comes("STATUS=0 of 0 streams live"));
  std::jthread people([&](const std::stop_token& stop) {
    MocapRoom room(port);
    for (int frame = 0; !stop.stop_requested(); ++frame) {
      if (frame % 50 == 0) room.describe();
      room.frame();
      std::this_thread::sleep_for(10ms);
    }
  });
  CHECK(stage.socket.comes("STATUS=2 of 2 streams live"));
}

TEST_CASE("a service says that it is ready, what it does, that it reloads, and that it ends") {
  ServiceStage stage("run");
  const auto first = stage.socket.message();
  INFO(stage.daemon->errors());
  REQUIRE(first);
  CHECK(*first == "READY=1");
  REQUIRE(stage.daemon->line());  // the endpoints are bound
  CHECK(stage.socket.comes("STATUS=1 of 1 streams live"));
  CHECK(stage.socket.comes("WATCHDOG=1"));
  // Without keys there is nothing to read again, and a service has no terminal that closes.
  stage.daemon->send(SIGHUP);
  CHECK(stage.socket.comes("RELOADING=1\nMONOTONIC_USEC="));
  CHECK(stage.socket.comes("READY=1"));
  CHECK(stage.socket.comes("WATCHDOG=1"));
  stage.daemon->send(SIGTERM);
  CHECK(stage.socket.comes("STOPPING=1"));
  CHECK(stage.daemon->exit_code() == 0);
}

TEST_CASE("a service is not ready while its config is wrong") {
  const TempFolder folder;
  const auto config = folder.write("posed.toml", "nonsense = 1\n");
  const auto path = folder.path() / "notify";
  const NotifySocket socket(path);
  Process wrong(Command({"env", "NOTIFY_SOCKET=" + path.string(), posed_binary().string(), "run",
                         "--config", config.string()}));
  CHECK(wrong.exit_code() == 2);
  CHECK_FALSE(socket.message(0ms));
}

TEST_CASE("a service whose thread stands still gives no sign of life, names it, and recovers") {
  ServiceStage stage;
  REQUIRE(stage.socket.comes("WATCHDOG=1"));
  bool first = true;
  for (const char* name :
       {"posed-reader", "posed-pipeline", "posed-publish", "posed-record", "posed-control",
        "posed-trigger", "posed-bodies", "posed-metrics", "out-vmc-walker"}) {
    INFO(name);
    const pid_t thread = thread_named(stage.daemon->pid(), name);
    REQUIRE(thread > 0);
    {
      const StoppedThread stopped(thread);
      CHECK(stage.daemon->comes_to_say("the thread " + std::string(name) + " is stuck"));
      stage.socket.forget();  // what it said before it noticed
      // For the first thread as long as systemd waits, for the others longer than between two
      // looks.
      CHECK_FALSE(stage.socket.comes("WATCHDOG=1", first ? kWithin : 700ms));
      first = false;
    }
    CHECK(stage.socket.comes("WATCHDOG=1"));
    CHECK(stage.daemon->comes_to_say("the thread " + std::string(name) + " goes on"));
  }
  stage.daemon->send(SIGTERM);
  CHECK(stage.daemon->exit_code() == 0);
}

// systemd's own judgement of the unit, from 0 (safe) to 10.
TEST_CASE("the unit of the service is locked down") {
  if (!std::filesystem::exists("/usr/bin/systemd-analyze")) {
    WARN("skipped: without systemd-analyze");
    return;
  }
  const auto unit = source_dir() / "config/systemd/posed@.service";
  Process analysis(Command({"systemd-analyze", "security", "--offline=true", "--no-pager",
                            "--threshold=15", unit.string()}));
  const std::string verdict = analysis.rest();
  INFO(verdict << analysis.errors());
  CHECK(analysis.exit_code() == 0);  // at most 1.5
  CHECK(has(verdict, "Overall exposure level"));
}

}  // namespace
}  // namespace posed::test
