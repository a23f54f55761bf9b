// The project's rules for source files as a test. Each check is first shown to fail on a bad
// example.
#include <catch2/catch.hpp>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>

#include "tests/support/shared.hpp"
#include "tests/unit/tidy/source_tree.hpp"

namespace {

using posed::tidy::Finding;
using posed::tidy::SourceFile;

const std::vector<SourceFile>& tree() {
  static const auto files = posed::tidy::read_source_tree(posed::test::source_dir());
  return files;
}

std::string listed(const std::vector<Finding>& findings) {
  std::ostringstream text;
  for (const Finding& f : findings) text << f.path << ':' << f.line << ": " << f.what << '\n';
  return text.str();
}

template <typename Check>
std::string findings_of(const Check& check) {
  std::vector<Finding> all;
  for (const SourceFile& file : tree()) {
    const auto found = check(file);
    all.insert(all.end(), found.begin(), found.end());
  }
  return listed(all);
}

// Calls use(path, text) for each file of the repository that people read.
template <typename Use>
void for_each_text(const Use& use) {
  const std::set<std::string> kinds{".hpp", ".cpp", ".md", ".txt", ".toml", ".proto", ".py", ""};
  for (std::filesystem::recursive_directory_iterator at(posed::test::source_dir()), end; at != end;
       ++at) {
    const std::filesystem::directory_entry& entry = *at;
    const std::string path =
        std::filesystem::relative(entry.path(), posed::test::source_dir()).generic_string();
    // Not ours, and other tests write there meanwhile.
    const bool others =
        path == "build" || path == ".git" || at->path().filename() == "node_modules";
    if (others) at.disable_recursion_pending();
    if (!entry.is_regular_file() || !kinds.contains(entry.path().extension())) continue;
    std::ifstream stream(entry.path());
    use(path, std::string(std::istreambuf_iterator<char>(stream), {}));
  }
}

}  // namespace

TEST_CASE("modules include only what the dependency rules allow", "[tidy]") {
  const auto bad = posed::tidy::source_from_text(
      "models/a.cpp", "#include \"proto/frame/frame.hpp\"\n#include \"drivers/driver.hpp\"\n");
  REQUIRE(listed(posed::tidy::check_includes(bad)).find("models/a.cpp:2") == 0);
  REQUIRE(tree().size() > 20);
  CHECK(findings_of(posed::tidy::check_includes) == "");
}

TEST_CASE("a folder includes only what its target links, and no targets form a cycle", "[tidy]") {
  const auto bad = posed::tidy::targets_from_text(
      "posed_module(posed_a UNITY FOLDERS daemon/a LINK posed_b X::Y)\n"
      "posed_module(posed_b\n  FOLDERS daemon/b LINK posed_c)\n"
      "posed_module(posed_c FOLDERS daemon/c daemon/d LINK)\n");
  REQUIRE(bad.size() == 3);
  CHECK(posed::tidy::check_cycles(bad).empty());
  const auto upward = posed::tidy::source_from_text(
      "daemon/d/x.cpp", "#include \"daemon/c/y.hpp\"\n#include \"daemon/a/z.hpp\"\n");
  REQUIRE(listed(posed::tidy::check_links(upward, bad)).find("daemon/d/x.cpp:2") == 0);
  const auto through =
      posed::tidy::source_from_text("daemon/a/x.cpp", "#include \"daemon/d/y.hpp\"");
  CHECK(posed::tidy::check_links(through, bad).empty());
  const auto any = posed::tidy::targets_from_text(
      "posed_module(posed_e FOLDERS daemon/e daemon/e/* LINK)\n"
      "posed_module(posed_f FOLDERS daemon/f LINK)\n");
  const auto sideways =
      posed::tidy::source_from_text("daemon/e/g/x.cpp", "#include \"daemon/f/y.hpp\"");
  REQUIRE(listed(posed::tidy::check_links(sideways, any)).find("daemon/e/g/x.cpp:1") == 0);
  auto circle = bad;
  circle[2].links.push_back("posed_a");
  REQUIRE(posed::tidy::check_cycles(circle).size() == 3);

  const auto targets = posed::tidy::read_targets(posed::test::source_dir());
  REQUIRE(targets.size() > 20);
  CHECK(listed(posed::tidy::check_cycles(targets)) == "");
  CHECK(findings_of(
            [&](const SourceFile& file) { return posed::tidy::check_links(file, targets); }) == "");
}

TEST_CASE("the daemon does without its commands", "[tidy]") {
  const auto targets = posed::tidy::read_targets(posed::test::source_dir());
  const auto bad = posed::tidy::source_from_text("daemon/assembly/x.cpp",
                                                 "#include \"daemon/tools/command/command.hpp\"\n");
  CHECK(listed(posed::tidy::check_links(bad, targets)).find("daemon/assembly/x.cpp:1") == 0);
}

TEST_CASE("files of a target can be joined: names in anonymous namespaces are unique", "[tidy]") {
  const auto a = posed::tidy::source_from_text(
      "daemon/a/a.cpp",
      "namespace posed {\nnamespace {\nusing A = int;\nint twice(\n    int a) {\n  return a;\n}\n"
      "struct Rig {\n  int once = 0;\n};\nconstexpr int kMost = 2;\n}  // namespace\n"
      "int open() { return 1; }\n}  // namespace posed\n");
  const auto b = posed::tidy::source_from_text(
      "daemon/b/b.cpp",
      "namespace posed {\nnamespace {\nusing A = int;\nint twice(\n    double b) {\n}\n"
      "template <typename T>\nclass Rig {\n};\nconst double kMost = 2;\nvoid once();\n}\n}\n"
      "namespace posed::other {\nnamespace {\nstruct Rig {};\n}\n}\n");
  const auto targets = posed::tidy::targets_from_text(
      "posed_module(a FOLDERS daemon/a daemon/b LINK)\nposed_module(c FOLDERS daemon/c LINK)\n");
  const std::string found = listed(posed::tidy::check_joined_names({a, b}, targets));
  CHECK(found ==
        "daemon/b/b.cpp:8: Rig is in daemon/a/a.cpp:8, too\n"
        "daemon/b/b.cpp:10: kMost is in daemon/a/a.cpp:11, too\n");

  auto all = posed::tidy::read_targets(posed::test::source_dir());
  const auto programs = posed::tidy::read_test_programs(posed::test::source_dir());
  REQUIRE(programs.size() > 8);
  all.insert(all.end(), programs.begin(), programs.end());
  CHECK(listed(posed::tidy::check_joined_names(tree(), all)) == "");
}

TEST_CASE("every folder of unit tests is built into a program", "[tidy]") {
  std::ifstream file(posed::test::source_dir() / "tests/CMakeLists.txt");
  const std::string programs{std::istreambuf_iterator<char>(file), {}};
  const auto is_built = [&](const std::string& folder) {
    for (const char end : {' ', ')', '\n'}) {
      if (programs.find(" " + folder + end) != std::string::npos) return true;
    }
    return false;
  };
  REQUIRE_FALSE(is_built("unit/models/no_such"));
  std::set<std::string> folders;
  for (const SourceFile& source : tree()) {
    if (!source.path.starts_with("tests/unit/") || !source.path.ends_with(".cpp")) continue;
    folders.insert(source.path.substr(6, source.path.rfind('/') - 6));
  }
  REQUIRE(folders.size() > 10);
  for (const std::string& folder : folders) {
    INFO(folder << " is in no posed_test line of tests/CMakeLists.txt");
    CHECK(is_built(folder));
  }
}

TEST_CASE("no file names a page outside the repository, and READMEs have titles", "[tidy]") {
  REQUIRE(posed::tidy::check_title("a/README.md", "#title : of a\n").size() == 1);
  REQUIRE(posed::tidy::check_references("a.md", std::string("x\nsee ../sha") + "red/a\n").size() ==
          1);
  std::vector<Finding> all;
  int files = 0;
  for_each_text([&](const std::string& path, const std::string& text) {
    // The one place where tests find recordings, and the page that says so.
    const bool names_it = path == "tests/support/shared.hpp" || path == "tests/README.md";
    if (!names_it)
      std::ranges::move(posed::tidy::check_references(path, text), std::back_inserter(all));
    std::ranges::move(posed::tidy::check_title(path, text), std::back_inserter(all));
    ++files;
  });
  CHECK(files > 300);
  CHECK(listed(all) == "");
}

TEST_CASE("where a page names tests, there are some", "[tidy]") {
  const auto programs = posed::tidy::read_test_programs(posed::test::source_dir());
  std::vector<posed::tidy::TestCase> tests;
  for (const SourceFile& file : tree()) {
    std::ranges::move(posed::tidy::tests_of(file), std::back_inserter(tests));
  }
  REQUIRE(tests.size() > 1000);
  const auto check = [&](const std::string& path, const std::string& text) {
    return posed::tidy::check_test_commands(path, text, tests, programs);
  };
  CHECK(check("a.md", "`build/bin/e2e \"[teach]\"`, `e2e \"*GLOVE that floods*\"`").empty());
  const auto found = check("a.md", "x\n`e2e \"[teach],[no such tag],no such test*\"`\n");
  REQUIRE(listed(found).starts_with("a.md:2: "));
  REQUIRE(found.size() == 2);
  std::vector<Finding> all;
  for_each_text([&](const std::string& path, const std::string& text) {
    if (path.ends_with(".md")) std::ranges::move(check(path, text), std::back_inserter(all));
  });
  CHECK(listed(all) == "");
}

TEST_CASE("lines are short and finished", "[tidy]") {
  const auto bad =
      posed::tidy::source_from_text("a.cpp", std::string(101, 'x') + "\n// TO" + "DO later\n");
  REQUIRE(posed::tidy::check_sizes(bad).size() == 2);
  CHECK(findings_of(posed::tidy::check_sizes) == "");
}

TEST_CASE("every field of the wire format is described", "[tidy]") {
  const auto bad = posed::tidy::source_from_text(
      "a.proto", "message A {\n  string a = 1;  // a name\n  repeated v1.B b = 2;\n}\n");
  CHECK(listed(posed::tidy::check_field_comments(bad)).find("a.proto:3") == 0);
  std::string missing;
  int files = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(posed::test::source_dir() / "proto/wire/posed/v1")) {
    std::ifstream file(entry.path());
    const std::string text(std::istreambuf_iterator<char>(file), {});
    const auto name = entry.path().filename().string();
    missing += listed(posed::tidy::check_field_comments(posed::tidy::source_from_text(name, text)));
    ++files;
  }
  CHECK(files == 4);
  CHECK(missing == "");
}

TEST_CASE("TOML and whole files are read through their guards", "[tidy]") {
  const auto bad = posed::tidy::source_from_text(
      "daemon/a.cpp",
      "auto a = toml::parse(text);\nauto b = toml::parse_file (path);\n"
      "out << file.rdbuf();\nstd::string all{std::istreambuf_iterator<char>(file), {}};\n"
      "auto c = parse_toml(text, file, limits);  // not toml::parse(text)\n"
      "catch (const toml::parse_error& error) {}\n");
  REQUIRE(posed::tidy::check_guarded_input(bad).size() == 4);
  const auto guard =
      posed::tidy::source_from_text("proto/text/toml.cpp", "return toml::parse(text, file);\n");
  REQUIRE(posed::tidy::check_guarded_input(guard).empty());
  CHECK(findings_of(posed::tidy::check_guarded_input) == "");
}

TEST_CASE("no path that cannot be used throws an exception", "[tidy]") {
  const auto bad = posed::tidy::source_from_text(
      "daemon/a.cpp",
      "if (std::filesystem::exists(path)) return;\n"
      "std::error_code ignored;\n"
      "if (std::filesystem::exists(path, ignored)) return;\n"
      "fs::rename(from.string() + suffix,\n           name(to), ignored);\n"
      "fs::rename(from, name(to));\n"
      "for (const auto& file : fs::directory_iterator(folder, ignored)) use(file);\n"
      "for (fs::directory_iterator at(folder, ignored), end; at != end; at.increment(ignored)) {}\n"
      "std::filesystem::directory_iterator at{folder};\n"
      "at != fs::directory_iterator();\n");
  const std::string found = listed(posed::tidy::check_throwing_paths(bad));
  CHECK(found.find("daemon/a.cpp:1:") != std::string::npos);
  CHECK(found.find("daemon/a.cpp:6:") != std::string::npos);
  CHECK(found.find("daemon/a.cpp:7:") != std::string::npos);
  CHECK(found.find("daemon/a.cpp:9:") != std::string::npos);
  CHECK(posed::tidy::check_throwing_paths(bad).size() == 4);
  CHECK(findings_of(posed::tidy::check_throwing_paths) == "");
}

TEST_CASE("TRY is no part of an expression", "[tidy]") {
  const auto good = posed::tidy::source_from_text(
      "daemon/a.cpp",
      "#define TRY(...) NOW(TRY(a))\n  TRY(run(a, f(b)));\n  if (a == b) TRY(run());\n  else "
      "TRY(b());\n"
      "  auto value =\n      TRY(\n          read(a));  // not f(TRY(b))\n  value = TRY(read(b));\n"
      "  RETRY(a + b);\n");
  CHECK(listed(posed::tidy::check_try(good)) == "");
  const std::vector<std::string> bad{"use(TRY(read()));",
                                     "auto a = *TRY(read());",
                                     "auto a = TRY(read()).size();",
                                     "auto a = b ? TRY(c()) : d;",
                                     "return TRY(read());",
                                     "A a{.b = TRY(read()), .c = 1};",
                                     "A a{TRY(read())};",
                                     "for (int i : TRY(all())) f(i);",
                                     "auto a = TRY(read(TRY(b())));",
                                     "if (a == TRY(b())) c();",
                                     "a += TRY(read());",
                                     "auto a = b +\n    TRY(c());"};
  for (const std::string& line : bad) {
    INFO(line);
    CHECK(posed::tidy::check_try(posed::tidy::source_from_text("daemon/a.cpp", line)).size() == 1);
  }
  CHECK(findings_of(posed::tidy::check_try) == "");
}

TEST_CASE("functions marked RT_SAFE neither allocate, lock, log, throw nor call the system",
          "[tidy]") {
  const auto bad = posed::tidy::source_from_text(
      "daemon/a.cpp",
      "RT_SAFE void f() {\n  v.push_back(1);\n  throw 1;\n  spdlog::info(\"x\");\n}\n"
      "void cold() { throw 2; }\n"
      "struct A {\n  RT_SAFE [[nodiscard]] int g() const noexcept;\n"
      "  template <int n>\n  RT_SAFE void h() {\n    throw n;\n  }\n};\n"
      "// RT-safe except for its write.\nvoid w() { ioctl(); }\n");
  int bodies = 0;
  REQUIRE(posed::tidy::check_hot_code(bad, bodies).size() == 5);
  REQUIRE(bodies == 3);
  bodies = 0;
  CHECK(findings_of([&bodies](const SourceFile& file) {
          return posed::tidy::check_hot_code(file, bodies);
        }) == "");
  CHECK(bodies >= 300);
}

TEST_CASE("every header is included somewhere", "[tidy]") {
  std::set<std::string> included;
  for (const SourceFile& file : tree()) {
    for (const std::string& line : file.lines) {
      const auto open = line.find('"');
      if (line.find("#include") == 0 && open != std::string::npos) {
        included.insert(line.substr(open + 1, line.rfind('"') - open - 1));
      }
    }
  }
  std::string orphans;
  for (const SourceFile& file : tree()) {
    if (file.path.ends_with(".hpp") && !included.contains(file.path)) orphans += file.path + "\n";
  }
  CHECK(orphans == "");
}

TEST_CASE("every module has a README", "[tidy]") {
  for (const char* module_name : {"proto", "models", "drivers", "daemon", "tests", "config"}) {
    INFO(module_name);
    std::ifstream readme(posed::test::source_dir() / module_name / "README.md");
    const std::string text{std::istreambuf_iterator<char>(readme), {}};
    CHECK(text.size() > 200);
  }
}
