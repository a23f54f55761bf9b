#include "daemon/config/config.hpp"

#include <fstream>
#include <regex>

#include <catch2/catch.hpp>

#include "models/stages/registry.hpp"
#include "proto/zmq/keys.hpp"
#include "tests/support/shared.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::config {
namespace {

// Drivers for these tests: one option of each type.
std::vector<drivers::Driver> two_drivers() {
  using drivers::OptionSpec;
  return {{"file",
           "a clip",
           {OptionSpec{"path", std::string(), true, true, "the clip to play"},
            OptionSpec{"loop", false, false, false, ""}, OptionSpec{"pace", 1.0, false, false, ""},
            OptionSpec{"first", std::int64_t{1}, false, false, ""}},
           nullptr,
           nullptr,
           nullptr},
          {"glove", "a glove", {}, nullptr, nullptr, nullptr}};
}

Reading read(const std::string& text) {
  static const auto drivers = two_drivers();
  return read_config(text, "stage/posed.toml", drivers);
}

constexpr const char* kWalker = R"(
[[stream]]
name = "walker"
driver = "file"
[stream.file]
path = "walk.bvh"
)";

// The only error for kWalker followed by these lines.
std::string complaint(const std::string& more, const std::string& start = kWalker) {
  const Reading reading = read(start + more);
  INFO(more);
  REQUIRE(reading.errors.size() == 1);
  CHECK(reading.errors[0].exit_code == ExitCode::kWrongUse);
  return reading.errors[0].text();
}

TEST_CASE("a small config gets every default") {
  const Reading reading = read(kWalker);
  REQUIRE(reading.errors.empty());
  const config::DaemonConfig defaults;
  CHECK(reading.config.publish_endpoint == defaults.publish_endpoint);
  CHECK(reading.config.control_endpoint == defaults.control_endpoint);
  REQUIRE(reading.config.streams.size() == 1);
  const auto& stream = reading.config.streams[0];
  CHECK(stream.name == "walker");
  CHECK(stream.driver == "file");
  CHECK(stream.stages.empty());
  CHECK(std::get<std::string>(stream.options.at("path")) == "stage/walk.bvh");
  CHECK(std::get<bool>(stream.options.at("loop")) == false);
  CHECK(std::get<double>(stream.options.at("pace")) == 1.0);
  CHECK(std::get<std::int64_t>(stream.options.at("first")) == 1);
  CHECK(reading.config.text == kWalker);
}

TEST_CASE("every value is stored in its field") {
  const Reading reading = read(R"(
realtime = false
share_cpu = false
publish.endpoint = "tcp://0.0.0.0:1"
publish.insecure = true
control.endpoint = "ipc:///tmp/posed"
[[stream]]
name = "a"
driver = "file"
publish_raw = true
stale_after_s = 2
[stream.file]
path = "/clips/walk.bvh"
loop = true
pace = 0
first = 7
[stream.style]
model = "walk.style"
alpha = -1.5
alpha_slew_per_s = 4.0
gate = true
gate_fallback = 0.25
auto_alpha = true
[stream.generate]
lag_frames = 3
lag_ms = 50
noise_deg = 2
model = "hand.gesture"
labels = "g 1"
tempo = 1.5
loop = true
[stream.constrain]
enabled = false
[[stream]]
name = "b"
driver = "glove"
)");
  REQUIRE(reading.errors.empty());
  const auto& config = reading.config;
  CHECK_FALSE(config.realtime);
  CHECK_FALSE(config.share_cpu);
  CHECK(config.publish_endpoint == "tcp://0.0.0.0:1");
  CHECK(config.control_endpoint == "ipc:///tmp/posed");
  REQUIRE(config.streams.size() == 2);
  const auto& a = config.streams[0];
  CHECK(a.publish_raw);
  CHECK(a.stale_after_s == 2.0);
  CHECK(std::get<std::string>(a.options.at("path")) == "/clips/walk.bvh");
  CHECK(std::get<bool>(a.options.at("loop")));
  CHECK(std::get<double>(a.options.at("pace")) == 0.0);
  CHECK(std::get<std::int64_t>(a.options.at("first")) == 7);
  CHECK(config.streams[1].driver == "glove");
  REQUIRE(a.stages.size() == 2);
  const StageConfig& style = a.stages[0];
  CHECK(style.type->name == "style");
  CHECK(style.model == "stage/walk.style");
  CHECK(parameter<double>(style.parameters, "alpha") == -1.5);
  CHECK(parameter<double>(style.parameters, "alpha_slew_per_s") == 4.0);
  CHECK(parameter<bool>(style.parameters, "gate"));
  CHECK(parameter<double>(style.parameters, "gate_fallback") == 0.25);
  CHECK(parameter<bool>(style.parameters, "auto_alpha"));
  const StageConfig& generate = a.stages[1];
  CHECK(generate.type->name == "generate");
  CHECK(generate.model == "stage/hand.gesture");
  CHECK(parameter<std::int64_t>(generate.parameters, "lag_frames") == 3);
  CHECK(parameter<double>(generate.parameters, "lag_s") == Approx(0.05));
  CHECK(parameter<double>(generate.parameters, "noise_rad") == Approx(0.0349065850));
  CHECK(parameter<std::string>(generate.parameters, "labels") == "g 1");
  CHECK(parameter<double>(generate.parameters, "tempo") == 1.5);
  CHECK(parameter<bool>(generate.parameters, "loop"));
  REQUIRE(a.off.size() == 1);
  CHECK(a.off[0]->name == "constrain");
  CHECK(a.default_stages);
  CHECK(config.streams[1].stages.empty());
  CHECK(config.streams[1].off.empty());
}

TEST_CASE("stages run in the order that the config says") {
  const Reading reading = read(std::string(kWalker) + R"([stream.style]
model = "m"
[[stream]]
name = "b"
driver = "glove"
stages = ["constrain", "generate"]
[stream.generate]
lag_ms = 170
)");
  REQUIRE(reading.errors.empty());
  const auto& stream = reading.config.streams[1];
  CHECK_FALSE(stream.default_stages);
  REQUIRE(stream.stages.size() == 2);
  CHECK(stream.stages[0].type->name == "constrain");
  CHECK(stream.stages[1].type->name == "generate");
  CHECK(parameter<double>(stream.stages[1].parameters, "lag_s") == Approx(0.17));
}

TEST_CASE("a word in a stage's table is one of those that it takes") {
  const Reading reading = read(std::string(kWalker) + "[stream.feet]\nroot = \"actor\"\n");
  REQUIRE(reading.errors.empty());
  REQUIRE(reading.config.streams[0].stages.size() == 1);
  const StageConfig& feet = reading.config.streams[0].stages[0];
  CHECK(parameter<std::string>(feet.parameters, "root") == "actor");
  CHECK(parameter<double>(feet.parameters, "limit_m") == Approx(0.08));
  CHECK(complaint("[stream.feet]\nroot = \"walk\"\n")
            .contains("stream.feet.root must be off, stride or actor, not 'walk'"));
  CHECK(complaint("[stream.feet]\nlimit_cm = 60.0\n").contains("from 0 to 50"));
}

TEST_CASE("a wrong list of stages is one sentence") {
  const auto complaint_for = [](const std::string& list) {
    return complaint("", "[[stream]]\nname = \"a\"\ndriver = \"glove\"\nstages = " + list +
                             "\n[stream.constrain]\n");
  };
  CHECK(complaint_for("[\"constrain\", \"feat\"]").contains("there is no stage 'feat'"));
  CHECK(complaint_for("[\"constrain\", \"constrain\"]").contains("in the list twice"));
  CHECK(complaint_for("[\"generate\"]").contains("constrain is not in this list"));
  CHECK(complaint_for("[\"style\", \"constrain\"]").contains("stage style needs a model"));
  CHECK(complaint_for("1").contains("stages"));
}

TEST_CASE("stages and drivers have different names") {
  for (const StageType* stage : stage_types()) {
    CHECK(drivers::find_driver(stage->name) == nullptr);
    CHECK_FALSE(stage->summary.empty());
    for (const ParameterSpec& spec : stage->parameters) CHECK_FALSE(spec.help.empty());
  }
}

TEST_CASE("each mistake is one sentence with file and line") {
  CHECK(complaint("lop = true\n") ==
        "stage/posed.toml:7: unknown key 'stream.file.lop'; the nearest known one here is 'loop'");
  CHECK(complaint("[publsh]\n")
            .find(":7: unknown key 'publsh'; the nearest known one here is"
                  " 'publish'") != std::string::npos);
  CHECK(complaint("loop = 1\n") ==
        "stage/posed.toml:7: stream.file.loop must be true or false, not an integer");
  CHECK(complaint("pace = \"fast\"\n").find("must be a number, not text") != std::string::npos);
  CHECK(complaint("first = 1.5\n").find("must be an integer, not a number") != std::string::npos);
  CHECK(complaint("[stream.style]\nmodel = \"m\"\nalpha = 3\n") ==
        "stage/posed.toml:9: stream.style.alpha = 3 is out of range: it takes a number from -2 to"
        " 2");
  CHECK(complaint("[stream.style]\nmodel = \"m\"\nweights = {sad = 0, old = 0.0}\n")
            .find("stage/posed.toml:9: weights: all are 0") != std::string::npos);
  CHECK(complaint("[stream.style]\nmodel = \"m\"\nweights = {sad = \"much\"}\n").find("must be") !=
        std::string::npos);
  CHECK(complaint("[stream.style]\nmodel = \"m\"\nweights = \"sad=0\"\n")
            .find("stage/posed.toml:9: weights: all are 0") != std::string::npos);
  CHECK(complaint("[stream.style]\nmodel = \"m\"\nmask = \"tail=1\"\n")
            .find("stage/posed.toml:9: mask: the body has no part 'tail'; it has: arms") !=
        std::string::npos);
  CHECK(complaint("[stream.style]\nmodel = \"m\"\nalpha = nan\n").find("out of range") !=
        std::string::npos);
  CHECK(complaint("[stream.style]\nalpha = 1\n").find("stream.style.model is missing") !=
        std::string::npos);
  CHECK(complaint("[stream]\n").find("not TOML") != std::string::npos);
  CHECK(complaint("[control]\nendpoint = \"127.0.0.1:5\"\n")
            .find(":8: '127.0.0.1:5' is not an endpoint") != std::string::npos);
  CHECK(complaint("[control]\nendpoint = \"tcp://127.0.0.1:5570\"\n").find("cannot share") !=
        std::string::npos);
}

TEST_CASE("the error for an unknown key names its table, or the known keys") {
  CHECK(complaint("", "[[stream]]\nname = \"a\"\ndriver = \"glove\"\nalpha = 0.5\n") ==
        "stage/posed.toml:4: unknown key 'stream.alpha'; it belongs in [stream.style]");
  CHECK(complaint("[stream.style]\nmodel = \"m\"\npublish_raw = true\n")
            .ends_with("unknown key 'stream.style.publish_raw'; it belongs in [stream]"));
  CHECK(complaint("[control]\nmodel = 1\n")
            .ends_with("it belongs in [stream.generate] or [stream.style]"));
  CHECK(complaint("xyzzy = 1\n").ends_with("known here: first, loop, pace, path"));
  // An untrusted key reaches the terminal without its control characters.
  CHECK(complaint("\"\\u001b[2J\" = 1\n").find("'stream.file.\\x1b[2J'") != std::string::npos);
}

TEST_CASE("generate: lags, tempo and labels are checked") {
  const std::string table = "[stream.generate]\nmodel = \"m\"\n";
  CHECK(complaint(table + "lag_frames = -1\n").find("an integer of frames from 0 to 170") !=
        std::string::npos);
  CHECK(complaint(table + "lag_frames = 0.5\n").find("must be an integer") != std::string::npos);
  CHECK(complaint(table + "lag_ms = 200\n").find("from 0 to 170") != std::string::npos);
  CHECK(complaint(table + "tempo = 3\n").find("from 0.5 to 2") != std::string::npos);
  CHECK(complaint(table + "noise_deg = -1\n").find("from 0 to 90") != std::string::npos);
  CHECK(complaint("[stream.generate]\nlabels = \"g\"\n").find("need a gesture model") !=
        std::string::npos);
  CHECK(complaint("[stream.constrain]\nenable = true\n").find("'enabled'") != std::string::npos);
}

TEST_CASE("the tables of recordings and triggers are checked") {
  CHECK(complaint("[record]\nclips = \"csv\"\n").find("bvh") != std::string::npos);
  CHECK(complaint("[record]\nfolder = \"\"\n").find("name a folder") != std::string::npos);
  CHECK(complaint("[record]\nframe = true\n").find("'frames'") != std::string::npos);
  CHECK(complaint("[trigger]\nlisten = \"0.0.0.0:1512\"\n").find("addresses in peers") !=
        std::string::npos);
  CHECK(complaint("[trigger]\npeers = [\"stage\"]\n").find("address in numbers") !=
        std::string::npos);
  const Reading reading = read(std::string(kWalker) +
                               "[record]\nfolder = \"/logs\"\nclips = \"bvh\"\n[trigger]\n"
                               "listen = \"0.0.0.0:7060\"\npeers = [\"192.168.1.5\"]\n");
  REQUIRE(reading.errors.empty());
  CHECK(reading.config.record->folder == "/logs");
  CHECK(reading.config.record->clips);
  CHECK(reading.config.trigger->peers.size() == 1);
  // What clients may fetch is recorded, unless [record] says otherwise.
  const std::string shows = "[control]\nrecordings = \"/takes\"\n";
  const Reading shown = read(shows + std::string(kWalker));
  REQUIRE(shown.errors.empty());
  CHECK(shown.config.recordings == "/takes");
  CHECK(shown.config.record->folder == "/takes");
  CHECK(shown.config.record->clips);
  const Reading both = read(shows + "[record]\nfolder = \"/logs\"\n" + std::string(kWalker));
  REQUIRE(both.errors.empty());
  CHECK(both.config.record->folder == "/logs");
  CHECK_FALSE(both.config.record->clips);
}

TEST_CASE("metrics are for this machine only, whatever else the config permits") {
  const std::string insecure = "[publish]\nendpoint = \"tcp://*:5570\"\ninsecure = true\n";
  for (const char* listen : {"0.0.0.0:5572", "192.168.1.5:5572", "[::]:5572"}) {
    INFO(listen);
    CHECK(complaint(insecure + "[metrics]\nlisten = \"" + listen + "\"\n").find("reverse proxy") !=
          std::string::npos);
  }
  CHECK(complaint("[metrics]\nlisten = \"localhost\"\n").find("an address and a port") !=
        std::string::npos);
  CHECK(complaint("[metrics]\ninsecure = true\n").find("insecure") != std::string::npos);
  const Reading off = read(kWalker);
  REQUIRE(off.errors.empty());
  CHECK_FALSE(off.config.metrics);
  const Reading on = read(std::string(kWalker) + "[metrics]\nlisten = \"[::1]:9000\"\n");
  REQUIRE(on.errors.empty());
  CHECK(on.config.metrics->listen == "[::1]:9000");
}

TEST_CASE("the error for a wrong unit names the right one") {
  const std::string stream = "[[stream]]\nname = \"w\"\ndriver = \"glove\"\n";
  CHECK(complaint("stale_after_s = \"500 ms\"\n", stream) ==
        "stage/posed.toml:4: stream.stale_after_s must be a number of seconds, not text");
  CHECK(complaint("stale_after_ms = 500\n", stream).find("'stale_after_s'") != std::string::npos);
  CHECK(complaint("stale_after_s = 0\n", stream).find("a number of seconds from 0.01 to 3600") !=
        std::string::npos);
}

TEST_CASE("streams: names, drivers and their tables") {
  const auto one = [](const std::string& name, const std::string& more = "") {
    return "[[stream]]\nname = \"" + name + "\"\ndriver = \"glove\"\n" + more;
  };
  CHECK(complaint("", "").find("there is no stream") != std::string::npos);
  CHECK(complaint("", "stream = 5\n").find("a list of tables") != std::string::npos);
  CHECK(complaint("", one("Walker")).find(":2: a stream's name has") != std::string::npos);
  CHECK(complaint("", one(std::string(33, 'a'))).find("a stream's name has") != std::string::npos);
  CHECK(complaint("", one("a") + one("a"))
            .find(":4: a second stream is named 'a' (the first"
                  " stands in line 1)") != std::string::npos);
  CHECK(complaint("", one("a", "publish_raw = true\n") + one("a-raw"))
            .find(":5: 'a-raw' is the"
                  " name") != std::string::npos);
  CHECK(complaint("", one(std::string(30, 'a'), "publish_raw = true\n")).find("longer than 32") !=
        std::string::npos);
  CHECK(complaint("", "[[stream]]\nname = \"\"\ndriver = \"glove\"\n").contains("1 to 32"));
  CHECK(complaint("", "[[stream]]\ndriver = \"glove\"\n").find("stream.name is missing") !=
        std::string::npos);
  CHECK(complaint("", "[[stream]]\nname=\"a\"\ndriver = \"fil\"\n[stream.file]\npath = \"x\"\n")
            .find(":3: there is no driver of this name; the nearest is 'file'") !=
        std::string::npos);
  CHECK(complaint("", "[[stream]]\nname = \"a\"\ndriver = \"file\"\n")
            .find(":1: stream.file.path is missing: the clip to play") != std::string::npos);
}

TEST_CASE("all errors are reported at once, in the file's order") {
  const Reading reading = read(R"(realtime = "yes"
[[stream]]
name = "A"
driver = "glove"
stale = 1
[stream.style]
alpha = 9
)");
  std::vector<int> lines;
  for (const Error& error : reading.errors) lines.push_back(error.line);
  CHECK(lines == std::vector<int>{1, 3, 5, 6, 7});
}

TEST_CASE("without keys nothing listens beyond this machine, unless the config says insecure") {
  CHECK(complaint("[publish]\nendpoint = \"tcp://0.0.0.0:5570\"\n")
            .find("insecure = true in"
                  " [publish]") != std::string::npos);
  CHECK(complaint("[control]\nendpoint = \"tcp://*:5571\"\n").find("[control]") !=
        std::string::npos);
  CHECK(read(kWalker + std::string("[control]\nendpoint = \"tcp://*:5\"\ninsecure = true\n"))
            .errors.empty());
}

TEST_CASE("security: keys are read and clients checked") {
  const test::TempFolder folder;
  REQUIRE(net::write_new_keys("server", folder.path()));
  const auto viewer = net::write_new_keys("viewer", folder.path());
  REQUIRE(viewer);
  const auto director = net::write_new_keys("director", folder.path());
  const auto drivers = two_drivers();
  const auto read_here = [&](const std::string& security) {
    return read_config(security + kWalker, folder.path() / "posed.toml", drivers);
  };
  const std::string start = "[publish]\nendpoint = \"tcp://*:5570\"\n[security]\n";
  const std::string first = "[[security.client]]\nname = \"v\"\npublic_key = \"viewer.pub\"\n";

  const auto good = read_here(start + "server_key = \"server.key\"\n" + first +
                              "[[security.client]]\nname = \"d\"\npublic_key = \"" +
                              director->public_z85 + "\"\nrights = [\"control\"]\n");
  REQUIRE(good.errors.empty());
  const auto& clients = good.config.security.clients;
  REQUIRE(clients.size() == 2);
  CHECK(clients[0].public_z85 == viewer->public_z85);
  CHECK(clients[0].may_subscribe);
  CHECK_FALSE(clients[0].may_control);
  CHECK_FALSE(clients[1].may_subscribe);
  CHECK(clients[1].may_control);

  const auto complaint_of = [&](const std::string& security) {
    const auto reading = read_here(security);
    REQUIRE_FALSE(reading.errors.empty());
    return reading.errors[0].message;
  };
  const std::string served = "[security]\nserver_key = \"server.key\"\n";
  CHECK(complaint_of("[security]\n" + first).find("no server_key") != std::string::npos);
  CHECK(complaint_of("[security]\nserver_key = \"no.key\"\n").find("No such file") !=
        std::string::npos);
  CHECK(complaint_of("[security]\nserver_key = \"server.pub\"\n").find("public half") !=
        std::string::npos);
  CHECK(complaint_of(served + "[[security.client]]\nname = \"x\"\npublic_key = \"viewer.key\"\n")
            .find("secret half") != std::string::npos);
  CHECK(complaint_of(served + first + first).find("two clients are named 'v'") !=
        std::string::npos);
  CHECK(complaint_of(served + first +
                     "[[security.client]]\nname = \"w\"\npublic_key = \"viewer.pub\"\n")
            .find("have the same key") != std::string::npos);
  CHECK(complaint_of(served + first + "rights = [\"root\"]\n").find("two rights") !=
        std::string::npos);
}

TEST_CASE("a config that is missing or not text gives one sentence") {
  const auto drivers = two_drivers();
  const test::TempFolder folder;
  const auto missing = load_config(folder.path() / "none.toml", drivers);
  REQUIRE_FALSE(missing);
  CHECK(missing.error().text().find("none.toml: cannot read the config: No such file") !=
        std::string::npos);
  CHECK_FALSE(load_config(folder.path(), drivers));
  for (const std::string& text :
       {std::string("\xff\xfe\0x", 4), std::string(100000, '['), std::string("a=\"\x1b[2J"),
        std::string("a = tr\x1b\n"), std::string("[[stream]]\n\"\x1b[2J\" = 1\n")}) {
    const auto reading = load_config(folder.write("bad.toml", text), drivers);
    REQUIRE_FALSE(reading);
    CHECK(reading.error().text().find('\x1b') == std::string::npos);
  }
}

TEST_CASE("a file that an option may name beside built-in names lies in the config's folder") {
  const auto option_of = [](const std::string& driver, const std::string& options,
                            const std::string& name) {
    const Reading reading = read_config("[[stream]]\nname = \"a\"\ndriver = \"" + driver +
                                            "\"\n[stream." + driver + "]\n" + options,
                                        "stage/posed.toml", drivers::registry());
    for (const Error& error : reading.errors) FAIL_CHECK(error.text());
    return std::get<std::string>(reading.config.streams.at(0).options.at(name));
  };
  CHECK(option_of("file", "path = \"a.bvh\"\nprofile = \"map.toml\"\n", "profile") ==
        "stage/map.toml");
  CHECK(option_of("file", "path = \"a.bvh\"\nprofile = \"cmu\"\n", "profile") == "cmu");
  CHECK(option_of("file", "path = \"a.bvh\"\n", "profile").empty());
  CHECK(option_of("described", "device = \"mine.toml\"\n", "device") == "stage/mine.toml");
  CHECK(option_of("described", "device = \"vmg30\"\n", "device") == "vmg30");
}

// The shipped file with every "#key = value" and "#[table]" line uncommented.
std::string shipped(bool with_commented_defaults) {
  std::ifstream file(test::source_dir() / "config/posed.toml");
  const std::regex commented(R"(^#([a-z_]+ = |\[))");
  std::string text;
  for (std::string line; std::getline(file, line);) {
    if (with_commented_defaults && std::regex_search(line, commented)) line.erase(0, 1);
    text += line + "\n";
  }
  return text;
}

TEST_CASE("the shipped config contains every key with its default") {
  const auto read_real = [](const std::string& text) {
    return read_config(text, test::source_dir() / "config/posed.toml", drivers::registry());
  };
  const Reading bare = read_real(shipped(false));
  REQUIRE(bare.errors.empty());

  const Reading full = read_real(shipped(true));
  // the key files of the example do not exist; there must be no other error
  for (const Error& error : full.errors) {
    if (error.message.find("cannot read the key") == std::string::npos) FAIL_CHECK(error.text());
  }
  // The file contains every key that the reader looks up.
  const std::string text = shipped(true);
  for (const std::string& key : full.known) {
    const std::string last = key.substr(key.rfind('.') + 1);
    INFO("config/posed.toml lacks the key " << key);
    CHECK(std::regex_search(text, std::regex("(^|\n)" + last + " = |\n\\[+" + key + "\\]")));
  }
  // The values in the file are the defaults: uncommenting all of them changes nothing.
  const auto& a = bare.config;
  const auto& b = full.config;
  CHECK(a.realtime == b.realtime);
  CHECK(a.share_cpu == b.share_cpu);
  CHECK(a.publish_endpoint == b.publish_endpoint);
  CHECK(a.publish_insecure == b.publish_insecure);
  CHECK(a.control_endpoint == b.control_endpoint);
  CHECK(a.control_insecure == b.control_insecure);
  CHECK_FALSE(a.record);
  REQUIRE(b.record);
  CHECK(b.record->folder == (test::source_dir() / "config/takes"));
  CHECK(b.record->frames == config::RecordConfig{}.frames);
  CHECK(b.record->clips == config::RecordConfig{}.clips);
  CHECK_FALSE(a.trigger);
  REQUIRE(b.trigger);
  CHECK(b.trigger->listen == config::TriggerConfig{}.listen);
  CHECK(b.trigger->peers.empty());
  CHECK_FALSE(a.metrics);
  REQUIRE(b.metrics);
  CHECK(b.metrics->listen == config::MetricsConfig{}.listen);
  CHECK(a.streams[0].publish_raw == b.streams[0].publish_raw);
  CHECK(a.streams[0].stale_after_s == b.streams[0].stale_after_s);
  CHECK(a.streams[0].options == b.streams[0].options);
  REQUIRE(b.streams[0].stages.size() == stage_types().size());
  for (const StageConfig& stage : b.streams[0].stages) {
    for (const ParameterSpec& spec : stage.type->parameters) {
      if (spec.required) continue;  // the file has an example
      INFO("config/posed.toml: " << stage.type->name << "." << spec.shown_name());
      CHECK((stage.parameters.at(std::string(spec.name)) == spec.default_value));
    }
  }
  CHECK(b.streams[0].off.empty());
  CHECK(a.max_streams == b.max_streams);
  REQUIRE(b.sources.size() == 1);
  CHECK(b.sources[0].named.size() == 1);
  for (const drivers::OptionSpec& option : drivers::find_driver(b.sources[0].driver)->options) {
    INFO("config/posed.toml: " << b.sources[0].driver << "." << option.name);
    CHECK((b.sources[0].options.at(std::string(option.name)) == option.default_value));
  }
  REQUIRE(b.outputs.size() == 8);
  const OutputConfig no_output;
  CHECK(b.outputs[0].left_hand == no_output.left_hand);
  CHECK(b.outputs[0].right_hand == no_output.right_hand);
  CHECK(b.outputs[0].rate_hz == no_output.rate_hz);
  CHECK(b.outputs[0].vrm1_names == no_output.vrm1_names);
  CHECK(b.outputs[0].assistant == no_output.assistant);
  CHECK(b.outputs[1].listen == no_output.listen);
  CHECK(b.outputs[1].peers == no_output.peers);
  CHECK(b.outputs[1].header == no_output.header);
  CHECK(b.outputs[3].euler == no_output.euler);
  CHECK(b.outputs[5].lz4 == no_output.lz4);
  CHECK(b.outputs[6].peers == no_output.peers);
  CHECK(b.outputs[6].group == no_output.group);
  CHECK(b.outputs[6].data_port == no_output.data_port);
  CHECK(b.outputs[6].version == no_output.version);
  CHECK(b.outputs[7].domain == no_output.domain);
  CHECK(b.outputs[7].interface == no_output.interface);
  CHECK(b.outputs[7].peers == no_output.peers);
  CHECK(b.outputs[7].topic == no_output.topic);
  CHECK(b.outputs[7].trajectory == no_output.trajectory);
}

}  // namespace
}  // namespace posed::config
