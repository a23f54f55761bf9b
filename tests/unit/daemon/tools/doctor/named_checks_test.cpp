// Each check of what a config names, where it is right and where it is wrong.
#include <catch2/catch.hpp>

#include <sys/stat.h>

#include <fstream>

#include "daemon/tools/doctor/doctor.hpp"
#include "proto/log/schema.hpp"
#include "proto/model/model_file.hpp"
#include "tests/support/has.hpp"
#include "tests/support/log_surgery.hpp"
#include "tests/unit/daemon/tools/doctor/sound_machine.hpp"

namespace posed::doctor {
namespace {

using test::glove_config;
using test::has;
using test::HealthyMachine;

// A log's file as far as its marks, of this format.
void write_marks(const std::filesystem::path& path, int format) {
  test::run_sql(path, "CREATE TABLE t(a); PRAGMA application_id=1347375941; PRAGMA user_version=" +
                          std::to_string(format));
}

TEST_CASE("doctor: without a config the checks of what it names are not made, which is right") {
  const HealthyMachine healthy;
  for (const Check& check :
       {check_disk(healthy.machine, nullptr), check_ports(healthy.machine, nullptr),
        check_keys(nullptr), check_models(nullptr), check_logs(nullptr)}) {
    INFO(check.name);
    CHECK(check.ok);
    CHECK_FALSE(check.looked);
    CHECK(check.found.contains("--config"));
  }
}

TEST_CASE("doctor: a recording needs an hour of disk") {
  HealthyMachine healthy;
  auto config = glove_config();
  CHECK(has(check_disk(healthy.machine, &config).found, "no [record]"));
  config.record = {.folder = healthy.folder.path() / "takes" / "new"};
  CHECK(check_disk(healthy.machine, &config).ok);
  std::ofstream(healthy.folder.path() / "file") << "x";
  for (const char* taken : {"file", "file/takes"}) {
    config.record->folder = healthy.folder.path() / taken;
    const Check in_the_way = check_disk(healthy.machine, &config);
    CHECK_FALSE(in_the_way.ok);
    CHECK(has(in_the_way.found, "file is a file, so it cannot be a folder for recordings"));
  }
  config.record->folder = healthy.folder.path() / "takes" / "new";
  const double an_hour = recorded_bytes_per_s(config) * 3600.0;
  CHECK(an_hour > 0.0);
  healthy.machine.free_bytes = [&](const std::filesystem::path& folder) {
    CHECK(folder == healthy.folder.path());  // the first that exists
    return static_cast<std::uint64_t>(an_hour * 0.9);
  };
  const Check full = check_disk(healthy.machine, &config);
  CHECK_FALSE(full.ok);
  CHECK(has(full.found, "for about 0.9 hours"));
  config.record->frames = true;  // needs more
  CHECK(recorded_bytes_per_s(config) * 3600.0 > an_hour);
  healthy.machine.may_write = [](const auto&) { return false; };
  CHECK(has(check_disk(healthy.machine, &config).fix, "sudo chown ann"));
}

TEST_CASE("doctor: the ports of a config have to be free") {
  HealthyMachine healthy;
  config::DaemonConfig config;
  config.trigger.emplace();
  CHECK(check_ports(healthy.machine, &config).found == "3 can be bound");
  healthy.machine.try_bind = [](const Listener& one) -> Result<> {
    if (one.who == "trigger") return fail("Address already in use");
    return {};
  };
  const Check bad = check_ports(healthy.machine, &config);
  CHECK_FALSE(bad.ok);
  CHECK(bad.found == "trigger: udp 127.0.0.1:1512 cannot be bound (Address already in use)");
  CHECK(has(bad.fix, "ss -tulpn"));
}

TEST_CASE("doctor: the ports of a config are those that run binds") {
  config::DaemonConfig config = glove_config();
  config.publish_endpoint = "tcp://*:5570";
  config.control_endpoint = "tcp://127.0.0.1:*";
  auto& output = config.outputs.emplace_back();
  output.name = "axis";
  output.kind = config::OutputKind::kBvh;
  config.streams[0].options["link"] = std::string("tcp");
  config::SourceConfig source;
  source.name = "stage";
  source.driver = "natnet";
  source.options = {{"listen", std::string("0.0.0.0:1511")}, {"group", std::string("239.0.0.1")}};
  config.sources.push_back(source);
  const auto listeners = listeners_of(config);
  REQUIRE(listeners.size() == 4);
  CHECK(listeners[0].endpoint == "0.0.0.0:5570");
  CHECK(listeners[1].who == "output 'axis'");
  CHECK(listeners[2].who == "stream 'right'");
  CHECK_FALSE(listeners[2].udp);
  CHECK(listeners[3].udp);
  CHECK(listeners[3].shared);
  config.streams[0].options["link"] = std::string("serial");
  CHECK(listeners_of(config).size() == 3);
}

TEST_CASE("doctor: a glove is wanted where it has a port of this machine") {
  auto config = glove_config();
  CHECK(wants_gloves(config));
  config.streams[0].options["port"] = std::string("/dev/ttyUSB0");
  CHECK(wants_gloves(config));
  config.streams[0].options["port"] = std::string("/tmp/emulated");
  CHECK_FALSE(wants_gloves(config));
  config.streams[0].options["port"] = std::string();
  config.streams[0].options["link"] = std::string("tcp");
  CHECK_FALSE(wants_gloves(config));
}

TEST_CASE("doctor: this machine binds a free port and refuses one in use") {
  const Machine here = this_machine();
  const Listener any{.who = "test", .udp = true, .endpoint = "127.0.0.1:0"};
  CHECK(here.try_bind(any));
  CHECK_FALSE(here.try_bind({.who = "test", .endpoint = "192.0.2.1:5570"}));  // of nobody
  CHECK_FALSE(here.user.empty());
  CHECK(here.free_bytes("/"));
}

TEST_CASE("doctor: secret keys are for their owner alone") {
  const HealthyMachine healthy;
  config::DaemonConfig config;
  CHECK(check_keys(&config).ok);
  const auto key = healthy.folder.write("server.key", std::string(40, 'k') + "\n");
  config.security.server_key = key;
  ::chmod(key.c_str(), 0600);
  CHECK(check_keys(&config).ok);
  ::chmod(key.c_str(), 0640);
  const Check bad = check_keys(&config);
  CHECK_FALSE(bad.ok);
  CHECK(bad.fix == "chmod 600 " + key.string());
  healthy.folder.write("server.key", "my password\n");
  ::chmod(key.c_str(), 0600);
  CHECK(has(check_keys(&config).found, "this is not a key"));
  std::filesystem::remove(key);
  CHECK(has(check_keys(&config).fix, "posed keygen server"));
}

TEST_CASE("doctor: models are of a version that this one reads") {
  const HealthyMachine healthy;
  auto config = glove_config();
  CHECK(check_models(&config).ok);
  v1::ModelFile file;
  file.mutable_style();
  std::string bytes = model_file::wrap(file);
  const auto path = healthy.folder.write("walk.style", bytes);
  config.streams[0].stages.push_back({.model = path});
  CHECK(check_models(&config).found == "1 that this version reads");
  bytes[8] = 99;  // version
  healthy.folder.write("walk.style", bytes);
  const Check bad = check_models(&config);
  CHECK_FALSE(bad.ok);
  CHECK(has(bad.found, path.string()));
}

TEST_CASE("doctor: logs are of a version that this one reads") {
  const HealthyMachine healthy;
  config::DaemonConfig config;
  CHECK(check_logs(&config).ok);
  config.record = {.folder = healthy.folder.path()};
  CHECK(has(check_logs(&config).found, "none in"));
  write_marks(healthy.folder.path() / "good.plog", 3);
  CHECK(check_logs(&config).found == "1 that this version reads");
  for (const auto& [version, why] :
       {std::pair{2, "development version"}, std::pair{log::kFormatVersion + 1, "newer posed"}}) {
    const auto path = healthy.folder.path() / "other.plog";
    write_marks(path, version);
    const Check bad = check_logs(&config);
    CHECK_FALSE(bad.ok);
    CHECK(has(bad.found, why));
    std::filesystem::remove(path);
  }
}

TEST_CASE("doctor: a sound machine passes every check, and no two have one name") {
  HealthyMachine healthy;
  healthy.plug_in();
  const auto config = glove_config();
  std::set<std::string> names;
  for (const Check& check : examine(healthy.machine, &config)) {
    INFO(check.name << ": " << check.found);
    CHECK(check.ok);
    CHECK(check.fix.empty());
    CHECK(names.insert(check.name).second);
  }
  CHECK(names.size() == 15);
}

}  // namespace
}  // namespace posed::doctor
