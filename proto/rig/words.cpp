#include "proto/rig/words.hpp"

#include <algorithm>
#include <charconv>
#include <map>
#include <set>
#include <utility>

namespace posed::rig {
namespace {

using Words = std::set<std::string_view>;
using FitTable = std::map<std::string_view, Fit>;
using Tokens = std::vector<std::string>;

Words words_of(std::string_view line) {
  Words out;
  while (!line.empty()) {
    const std::size_t end = std::min(line.find(' '), line.size());
    if (end > 0) out.insert(line.substr(0, end));
    line.remove_prefix(std::min(end + 1, line.size()));
  }
  return out;
}

const Words& noise() {
  static const Words words = words_of(
      "jnt joint bone bn def org mch drv sk skel bip bip01 bip001 biped valvebiped mixamorig rig "
      "character actor cc base rl fk stretch bend x c j b m node deform std human humanoid main "
      "ref cf n xy xz yx yz zx zy");
  return words;
}

const Words& helpers() {
  static const Words words = words_of(
      "twist roll share end nub tip top site ik pole target tracker helper aux eff effector prop "
      "props weapon eye eyes jaw tongue teeth face facial brow eyebrow lip mouth cheek nose ear "
      "hair breast cloth skirt muscle mesh geo heel dummy attach socket support cancel correction "
      "pad vertex newton buttock");
  return words;
}

// Longest first. Signs of other writings mean an English word.
constexpr std::array<std::pair<std::string_view, std::string_view>, 26> kSigns{
    {{"左", " left "},     {"右", " right "},     {"下半身", " pelvis "}, {"上半身", " spine "},
     {"足首", " ankle "},  {"手首", " wrist "},   {"つま先", " toe "},    {"ひじ", " elbow "},
     {"ひざ", " knee "},   {"肩", " collar "},    {"腕", " upperarm "},   {"足", " leg "},
     {"首", " neck "},     {"頭", " head "},      {"センター", " root "}, {"親指", " thumb "},
     {"人指", " index "},  {"人差指", " index "}, {"中指", " middle "},   {"薬指", " ring "},
     {"小指", " little "}, {"捩", " twist "},     {"目", " eye "},        {"先", " end "},
     {"ＩＫ", " ik "},     {"IK", " ik "}}};

FitTable table_of(std::initializer_list<std::pair<Fit, std::string_view>> lines) {
  FitTable out;
  for (const auto& [fit, line] : lines) {
    for (const std::string_view word : words_of(line)) out.insert_or_assign(word, fit);
  }
  return out;
}

// Shoulder, UpperArm, LowerArm, Hand.
const FitTable& arm_words() {
  static const FitTable table =
      table_of({{{1, 0, 0, 0}, "collar clavicle collarbone clav clavic sako"},
                {{.8, 0, 0, 0}, "scapula"},
                {{.8, .7, 0, 0}, "shoulder shol kata"},
                {{.3, 1, 0, 0}, "shldr shoulderjoint"},
                {{0, .8, .1, 0}, "arm ude"},
                {{0, 1, 0, 0}, "upperarm uparm uarm armupper humerus bicep upperarmbend shldrbend"},
                {{0, 0, 1, 0},
                 "forearm farm lowerarm lowarm loarm foarm forarm armlower radius ulna elbow elb "
                 "hiji forearmbend"},
                {{0, 0, 0, .9}, "hand wrist carpus te"},
                {{0, 0, 0, .5}, "palm"}});
  return table;
}

// UpperLeg, LowerLeg, Foot, Toes.
const FitTable& leg_words() {
  static const FitTable table =
      table_of({{{1, 0, 0, 0}, "thigh upperleg upleg legupper femur thighbend momo tg"},
                {{.9, 0, 0, 0}, "hip"},
                {{.1, 0, 0, 0}, "hipjoint groin buttock pelvis"},
                {{.6, .8, 0, 0}, "leg asi"},
                {{0, 1, 0, 0}, "shin calf tibia lowerleg lowleg loleg leglower knee crus sune"},
                {{0, 0, 1, 0}, "ankle"},
                {{0, 0, .9, .5}, "foot"},
                {{0, 0, 0, 1}, "toe toes toebase ball tsumasaki"},
                {{0, 0, 0, .9}, "forefoot"},
                {{0, 0, 0, .6}, "metatarsal metatarsals metatarsophalangeal hallux"}});
  return table;
}

const Words& trunk_words() {
  static const Words words = words_of(
      "spine spina back lowerback upperback abdomen abdomenlower abdomenupper stomach belly ab "
      "torso waist chest upperchest chestupper chestlower thorax rib ribs sternum bust body sebo "
      "mune tospine spinelower spineupper");
  return words;
}

const Words& pelvis_words() {
  static const Words words = words_of("hips hip pelvis lowerbody kosi cog");
  return words;
}

const Words& neck_words() {
  static const Words words =
      words_of("neck lowerneck upperneck necklower neckupper kubi necktwist");
  return words;
}

const Words& head_words() {
  static const Words words = words_of("head skull kao atama");
  return words;
}

const std::map<std::string_view, int>& finger_words() {
  static const std::map<std::string_view, int> words{
      {"thumb", 0},  {"thmb", 0},   {"oya", 0},    {"index", 1}, {"inde", 1},
      {"fore", 1},   {"hito", 1},   {"middle", 2}, {"mid", 2},   {"midd", 2},
      {"naka", 2},   {"ring", 3},   {"third", 3},  {"kusu", 3},  {"pinky", 4},
      {"pinkey", 4}, {"little", 4}, {"litt", 4},   {"small", 4}, {"ko", 4}};
  return words;
}

bool is_anatomical(std::string_view word) {
  constexpr std::array<std::string_view, 2> kFinger{"finger", "fingers"};
  return arm_words().contains(word) || leg_words().contains(word) || trunk_words().contains(word) ||
         pelvis_words().contains(word) || (neck_words().contains(word) && word != "necktwist") ||
         head_words().contains(word) || finger_words().contains(word) ||
         std::ranges::find(kFinger, word) != kFinger.end();
}

bool is_upper(char c) { return c >= 'A' && c <= 'Z'; }
bool is_lower(char c) { return c >= 'a' && c <= 'z'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

// FBX programs write a sign that they allow in no name (a blank, a byte of an accented letter) by
// its number: "FBXASC032" is a blank.
std::string without_fbx_signs(std::string_view name) {
  constexpr std::string_view kMark = "FBXASC";
  constexpr std::size_t kDigits = 3;
  std::string out;
  while (!name.empty()) {
    const char* const digits = name.data() + std::min(kMark.size(), name.size());
    unsigned char sign = 0;
    const bool is_sign = name.size() >= kMark.size() + kDigits && name.starts_with(kMark) &&
                         std::from_chars(digits, digits + kDigits, sign).ptr == digits + kDigits &&
                         sign > 0;
    out += is_sign ? static_cast<char>(sign) : name.front();
    name.remove_prefix(is_sign ? kMark.size() + kDigits : 1);
  }
  return out;
}

std::string without_maker(std::string_view name) {
  if (const std::size_t cut = name.find_last_of(":|/"); cut != std::string_view::npos) {
    name.remove_prefix(cut + 1);
  }
  if (name.starts_with("mixamorig")) {
    name.remove_prefix(9);
    while (!name.empty() && is_digit(name.front())) name.remove_prefix(1);
  }
  return std::string(name);
}

void replace_all(std::string& text, std::string_view from, std::string_view to) {
  for (std::size_t at = text.find(from); at != std::string::npos;
       at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
}

// The length of the token at the beginning of `text`: digits, capitals before a capitalised word
// ("J" of "JBip"), one word in camel case, or capitals. 0 for anything else.
std::size_t token_length(std::string_view text) {
  const auto run = [text](std::size_t from, bool (*is)(char)) {
    while (from < text.size() && is(text[from])) ++from;
    return from;
  };
  if (const std::size_t digits = run(0, is_digit); digits > 0) return digits;
  const std::size_t capitals = run(0, is_upper);
  const std::size_t word = run(capitals, is_lower);
  if (capitals > 1 && word > capitals) return capitals - 1;
  return word;
}

Tokens tokens_of(std::string_view joint_name) {
  std::string name = without_maker(without_fbx_signs(joint_name));
  for (const auto& [sign, word] : kSigns) replace_all(name, sign, word);
  for (const char* arm : {"LUArm", "LFArm", "RUArm", "RFArm"}) {  // Motive
    const std::string text(arm);
    replace_all(name, text, text.substr(0, 1) + ' ' + text.substr(1));
  }
  Tokens out;
  for (std::string_view rest = name; !rest.empty();) {
    const std::size_t length = token_length(rest);
    if (length > 0) {
      std::string& token = out.emplace_back(rest.substr(0, length));
      for (char& c : token) c = is_upper(c) ? static_cast<char>(c - 'A' + 'a') : c;
    }
    rest.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return out;
}

NameSide side_word(std::string_view token) {
  // English, then German, French, Spanish, Italian and Portuguese.
  static const Words left = words_of(
      "l left lf lft lt links gauche izquierda izquierdo sinistra sinistro esquerda esquerdo");
  static const Words right =
      words_of("r right rt rgt rechts droite droit derecha derecho destra destro direita direito");
  if (left.contains(token)) return NameSide::kLeft;
  return right.contains(token) ? NameSide::kRight : NameSide::kNone;
}

// Splits a side off "lfemur", "lefthand", "handleft", if the rest is an anatomical word.
NameSide split_side(std::string& token) {
  constexpr std::array<std::pair<std::string_view, NameSide>, 4> kGlued{
      {{"left", NameSide::kLeft},
       {"right", NameSide::kRight},
       {"l", NameSide::kLeft},
       {"r", NameSide::kRight}}};
  if (is_anatomical(token)) return NameSide::kNone;
  for (const auto& [text, side] : kGlued) {
    if (token.starts_with(text) && is_anatomical(std::string_view(token).substr(text.size()))) {
      token.erase(0, text.size());
      return side;
    }
    const std::size_t rest = token.size() - std::min(token.size(), text.size());
    if (text.size() > 1 && token.ends_with(text) &&
        is_anatomical(std::string_view(token).substr(0, rest))) {
      token.resize(rest);
      return side;
    }
  }
  return NameSide::kNone;
}

// Letters that count joints, as in leg_a, leg_b and leg_c, become numbers: a one, b two. Elsewhere
// one letter is a side, or says nothing.
void number_letters(std::vector<Tokens>& all) {
  const auto is_counter = [](const std::string& token) {
    return token.size() == 1 && token[0] >= 'a' && token[0] <= 'h';
  };
  const auto without = [](const Tokens& tokens, std::size_t at) {
    std::string key;
    for (std::size_t i = 0; i < tokens.size(); ++i) key += (i == at ? "*" : tokens[i]) + ' ';
    return key;
  };
  const auto each = [&](const auto& use) {
    for (Tokens& tokens : all) {
      constexpr std::size_t kMaxTokens = 16;  // longer names count nothing
      for (std::size_t i = 1; i < std::min(tokens.size(), kMaxTokens); ++i) {
        if (is_counter(tokens[i])) use(tokens, i);
      }
    }
  };
  std::map<std::string, std::string> letters;
  each([&](const Tokens& tokens, std::size_t i) { letters[without(tokens, i)] += tokens[i]; });
  std::vector<std::pair<std::string*, std::string>> numbers;
  each([&](Tokens& tokens, std::size_t i) {
    const std::string& seen = letters[without(tokens, i)];
    if (!seen.contains('a') || !seen.contains('b')) return;
    numbers.emplace_back(&tokens[i], std::to_string(tokens[i][0] - 'a' + 1));
  });
  for (auto& [token, number] : numbers) *token = std::move(number);
}

JointName parse_one(const Tokens& tokens) {
  JointName name;
  for (std::string token : tokens) {
    if (is_digit(token.front())) {
      name.digits += (name.digits.empty() ? "" : "_") + token;
      continue;
    }
    if (name.side == NameSide::kNone) {
      name.side = side_word(token);
      if (name.side != NameSide::kNone) continue;
      name.side = split_side(token);
    }
    const bool helps = helpers().contains(token);
    name.helper = name.helper || helps;
    if (helps || !noise().contains(token)) name.words.push_back(std::move(token));
  }
  for (const std::string& word : name.words) name.stem += word;
  return name;
}

// Drops the first or the last token where at least four of five joints share it. Returns whether
// there was one.
bool drop_common(std::vector<Tokens>& all, bool first) {
  std::map<std::string_view, std::size_t> count;
  const auto at = [first](const Tokens& t) -> const std::string& {
    return first ? t.front() : t.back();
  };
  for (const Tokens& tokens : all) {
    if (!tokens.empty()) ++count[at(tokens)];
  }
  const auto most = std::ranges::max_element(
      count, {}, [](const auto& entry) { return std::pair(entry.second, entry.first); });
  if (most == count.end() || 5 * most->second < 4 * all.size()) return false;
  const std::string common(most->first);
  // Nearly all joints are of a "body".
  const bool matters = is_anatomical(common) && common != "body";
  if (side_word(common) != NameSide::kNone || matters) return false;
  for (Tokens& tokens : all) {
    if (tokens.empty() || at(tokens) != common) continue;
    tokens.erase(first ? tokens.begin() : tokens.end() - 1);
  }
  return true;
}

std::string joined(const std::vector<std::string>& words, std::size_t from, std::size_t to) {
  std::string out;
  for (std::size_t i = from; i < to; ++i) out += words[i];
  return out;
}

// Looks up the whole stem, then the stem without its first or its last words, which fits less: the
// joint "collar" is more a shoulder than a "collar p" beside it.
std::optional<Fit> fit_of(const JointName& name, const FitTable& table) {
  if (name.helper) return std::nullopt;
  const auto look = [&table](std::string_view word) {
    const auto at = table.find(word);
    return at == table.end() ? std::nullopt : std::optional(at->second);
  };
  if (const auto fit = look(name.stem)) return fit;
  if (finger_of(name) || is_any_finger(name)) return std::nullopt;
  constexpr double kPart = 0.98;
  constexpr std::size_t kMaxWords = 8;  // longer names say something else
  for (std::size_t i = 1; i < std::min(name.words.size(), kMaxWords); ++i) {
    auto fit = look(joined(name.words, i, name.words.size()));
    if (!fit) fit = look(joined(name.words, 0, i));
    if (!fit) continue;
    for (double& slot : *fit) slot *= kPart;
    return fit;
  }
  return std::nullopt;
}

}  // namespace

bool JointName::has(std::string_view word) const {
  return std::ranges::find(words, word) != words.end();
}

std::vector<JointName> parse_names(const std::vector<std::string_view>& names) {
  std::vector<Tokens> all;
  for (const std::string_view name : names) all.push_back(tokens_of(name));
  constexpr std::size_t kMinJoints = 6;  // fewer may well share a word that matters
  if (all.size() >= kMinJoints) {
    constexpr int kMaxMakerTokens = 6;  // "Rig|ValveBiped.Bip01_"
    for (int i = 0; i < kMaxMakerTokens && drop_common(all, true); ++i) {
    }
    drop_common(all, false);
  }
  number_letters(all);
  std::vector<JointName> out;
  for (const Tokens& tokens : all) out.push_back(parse_one(tokens));
  return out;
}

std::optional<Fit> arm_fit(const JointName& name) { return fit_of(name, arm_words()); }
std::optional<Fit> leg_fit(const JointName& name) { return fit_of(name, leg_words()); }

bool is_trunk(const JointName& name) {
  return name.side == NameSide::kNone && !name.helper &&
         (trunk_words().contains(name.stem) || name.has("spine") || name.has("chest"));
}

bool is_pelvis(const JointName& name) {
  return name.side == NameSide::kNone && pelvis_words().contains(name.stem);
}

bool is_neck(const JointName& name) {
  return name.side == NameSide::kNone && neck_words().contains(name.stem);
}

bool is_head(const JointName& name) {
  if (name.side != NameSide::kNone) return false;
  if (head_words().contains(name.stem)) return true;
  // Builders of rigs name the part before the joint: "neck_C0_head" ends a neck.
  const auto is_part = [](const std::string& word) {
    return neck_words().contains(word) || trunk_words().contains(word);
  };
  return name.words.size() > 1 && head_words().contains(name.words.back()) &&
         std::all_of(name.words.begin(), name.words.end() - 1, is_part);
}

bool is_any_finger(const JointName& name) {
  return name.has("finger") || name.has("fing") || name.has("digit");
}

std::optional<int> finger_of(const JointName& name) {
  // Anatomists count the fingers, and their middle phalanges are no middle fingers.
  constexpr std::array<std::string_view, 5> kOrdinals{"first", "second", "third", "fourth",
                                                      "fifth"};
  if (name.has("phalange") || name.has("phalanx") || name.has("metacarpal")) {
    for (std::size_t i = 0; i < kOrdinals.size(); ++i) {
      if (name.has(kOrdinals[i])) return static_cast<int>(i);
    }
  }
  for (std::size_t i = 0; i < name.words.size(); ++i) {
    const auto at = finger_words().find(name.words[i]);
    const bool is_limb =
        i + 1 < name.words.size() && (name.words[i + 1] == "arm" || name.words[i + 1] == "foot");
    if (at != finger_words().end() && !(at->first == "fore" && is_limb)) return at->second;
  }
  return std::nullopt;
}

}  // namespace posed::rig
