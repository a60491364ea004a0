#include "identify/lcm_types.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "forereach/numerics/text.h"
#include "task/config_error.h"
#include "task/files.h"
#include "task/number.h"

namespace forereach {
namespace {

constexpr std::int64_t kLargestTypeFile = kMegabyte;
constexpr std::size_t kDeepestType = 32;
constexpr int kMostHashed = 1 << 16;  // structs in one another, each counted as often as it is used

struct Primitive {
  std::string_view name;
  std::size_t bytes;
};
constexpr Primitive kPrimitives[] = {{"int8_t", 1}, {"int16_t", 2}, {"int32_t", 4}, {"int64_t", 8}, {"byte", 1},
                                     {"float", 4},  {"double", 8},  {"boolean", 1}, {"string", 0}};

const Primitive* PrimitiveOf(std::string_view type) {
  const auto found = std::ranges::find(kPrimitives, type, &Primitive::name);
  return found == std::end(kPrimitives) ? nullptr : found;
}

// As lcm-gen does, with its signed shift.
std::int64_t Updated(std::int64_t hash, char c) {
  return static_cast<std::int64_t>((static_cast<std::uint64_t>(hash) << 8 ^ static_cast<std::uint64_t>(hash >> 55)) +
                                   static_cast<std::uint64_t>(static_cast<std::int64_t>(c)));
}

std::int64_t Updated(std::int64_t hash, std::string_view text) {
  hash = Updated(hash, static_cast<char>(text.size()));
  for (const char c : text) hash = Updated(hash, c);
  return hash;
}

std::uint64_t BigEndian(Bytes bytes) {
  std::uint64_t value = 0;
  for (const std::uint8_t byte : bytes) value = value << 8 | byte;
  return value;
}

double NumberOf(std::string_view type, Bytes bytes) {
  const std::uint64_t bits = BigEndian(bytes);
  if (type == "double") return std::bit_cast<double>(bits);
  if (type == "float") return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
  if (type == "byte" || type == "boolean") return static_cast<double>(bits);
  const unsigned unused = 64 - 8 * static_cast<unsigned>(bytes.size());
  return static_cast<double>(static_cast<std::int64_t>(bits << unused) >> unused);
}

}  // namespace

// ---- The language

class LcmTypes::Parser {
 public:
  Parser(const std::string& path, const std::string& text, std::map<std::string, Struct>& structs)
      : path_(path), text_(text), structs_(structs) {}

  void Parse() {
    for (Next(); !token_.empty();) {
      if (token_ == "package") {
        Next();
        package_ = Name() + ".";
        Expect(";");
      } else if (token_ == "struct") {
        Next();
        ParseStruct();
      } else {
        Fail(fmt::format("'{}' is neither package nor struct", token_));
      }
    }
  }

 private:
  [[noreturn]] void Fail(const std::string& what) const { throw ConfigError("{}:{}: {}", path_, line_, what); }

  void Skip(std::size_t end) {
    end = std::min(end, text_.size());
    line_ += static_cast<int>(std::count(text_.begin() + static_cast<std::ptrdiff_t>(at_),
                                         text_.begin() + static_cast<std::ptrdiff_t>(end), '\n'));
    at_ = end;
  }

  static bool IsWord(char c) {
    return ('a' <= c && c <= 'z') || ('A' <= c && c <= 'Z') || ('0' <= c && c <= '9') || c == '_' || c == '.' ||
           c == '+' || c == '-';
  }

  // Sets token_ to the next word or character, and to nothing at the end.
  void Next() {
    for (;;) {
      Skip(std::min(text_.find_first_not_of(" \t\r\n\f\v", at_), text_.size()));
      if (text_.compare(at_, 2, "//") == 0)
        Skip(text_.find('\n', at_));
      else if (text_.compare(at_, 2, "/*") == 0)
        Skip(std::min(text_.find("*/", at_ + 2), text_.size() - 2) + 2);
      else
        break;
    }
    std::size_t end = at_;
    while (end < text_.size() && IsWord(text_[end])) ++end;
    if (end == at_ && end < text_.size()) ++end;
    token_ = text_.substr(at_, end - at_);
    at_ = end;
  }

  std::string Name() {
    if (token_.empty() || !IsWord(token_[0]) || IsDigit(token_[0])) Fail(fmt::format("'{}' is no name", token_));
    std::string name = token_;
    Next();
    return name;
  }
  void Expect(const char* what) {
    if (token_ != what) Fail(fmt::format("'{}' stands where {} has to be", token_, what));
    Next();
  }

  void ParseStruct() {
    const std::string name = package_ + Name();
    Struct type;
    constants_.clear();
    Expect("{");
    while (token_ != "}") {
      if (token_.empty()) Fail(fmt::format("the file ends inside {}", name));
      if (token_ == "const")
        ParseConstants();
      else
        ParseMembers(type);
    }
    Next();
    if (token_ == ";") Next();
    if (!structs_.emplace(name, std::move(type)).second) Fail(fmt::format("{} is defined twice", name));
  }

  void ParseConstants() {
    Next();
    static_cast<void>(Name());
    for (;;) {
      const std::string name = Name();
      Expect("=");
      constants_[name] = token_;
      Next();
      if (token_ != ",") break;
      Next();
    }
    Expect(";");
  }

  void ParseMembers(Struct& type) {
    const std::string of = Name();
    for (;;) {
      Member member{of, Name(), {}};
      while (token_ == "[") {
        Next();
        const auto constant = constants_.find(token_);
        const auto [value, problem] = ParseInteger(constant == constants_.end() ? token_ : constant->second);
        const bool is_member = std::ranges::any_of(type.members, [&](const Member& m) { return m.name == token_; });
        if (!problem.empty() && !is_member) Fail(fmt::format("'{}' is no size, and no member before it", token_));
        if (problem.empty() && value < 0) Fail(fmt::format("the size {} is negative", token_));
        member.dimensions.push_back({problem.empty(), token_, problem.empty() ? value : 0});
        Next();
        Expect("]");
      }
      type.members.push_back(std::move(member));
      if (token_ != ",") break;
      Next();
    }
    Expect(";");
  }

  const std::string& path_;
  const std::string& text_;
  std::map<std::string, Struct>& structs_;
  std::map<std::string, std::string> constants_;  // of the struct
  std::size_t at_ = 0;
  int line_ = 1;
  std::string token_, package_;
};

// ---- Messages

// Goes through a message member by member.
class LcmTypes::Walker {
 public:
  Walker(const LcmTypes& types, const std::vector<std::string>& places, Bytes rest)
      : types_(types), places_(places), rest_(rest), values_(places.size(), std::numeric_limits<double>::quiet_NaN()) {}

  std::optional<std::vector<double>> Walk(const std::string& type) {
    if (!WalkStruct(type, "", 0) || !rest_.empty()) return std::nullopt;
    return values_;
  }

 private:
  bool WalkStruct(const std::string& type, const std::string& at, std::size_t depth) {
    if (depth > kDeepestType) return false;
    std::map<std::string, std::int64_t> sizes;
    for (const Member& member : types_.structs_.at(type).members) {
      const std::string place = at.empty() ? member.name : at + "." + member.name;
      const bool is_number = member.dimensions.empty() && PrimitiveOf(member.type) && member.type != "string";
      if (is_number) {
        const std::size_t bytes = PrimitiveOf(member.type)->bytes;
        if (rest_.size() >= bytes)
          sizes[member.name] = static_cast<std::int64_t>(NumberOf(member.type, rest_.first(bytes)));
      }
      if (!WalkArray(type, member, 0, place, sizes, depth)) return false;
    }
    return true;
  }

  bool WalkArray(const std::string& user, const Member& member, std::size_t dimension, const std::string& place,
                 const std::map<std::string, std::int64_t>& sizes, std::size_t depth) {
    if (dimension == member.dimensions.size()) return WalkValue(user, member, place, depth);
    const Dimension& own = member.dimensions[dimension];
    const auto size = sizes.find(own.size);
    const std::int64_t count = own.is_constant ? own.value : size == sizes.end() ? -1 : size->second;
    // Elements may be empty structs, which no message ends.
    if (count < 0 || count > kMostElements) return false;
    for (std::int64_t i = 0; i < count; ++i)
      if (!WalkArray(user, member, dimension + 1, fmt::format("{}[{}]", place, i), sizes, depth)) return false;
    return true;
  }

  bool WalkValue(const std::string& user, const Member& member, const std::string& place, std::size_t depth) {
    if (++walked_ > kMostElements) return false;
    const Primitive* const primitive = PrimitiveOf(member.type);
    if (!primitive) return WalkStruct(types_.Resolved(member.type, user), place, depth + 1);
    std::size_t bytes = primitive->bytes;
    if (member.type == "string") {
      if (rest_.size() < 4) return false;
      bytes = 4 + static_cast<std::size_t>(BigEndian(rest_.first(4)));
    }
    if (rest_.size() < bytes) return false;
    if (member.type != "string")
      for (std::size_t i = 0; i < places_.size(); ++i)
        if (places_[i] == place) values_[i] = NumberOf(member.type, rest_.first(bytes));
    rest_ = rest_.subspan(bytes);
    return true;
  }

  static constexpr std::int64_t kMostElements = 1 << 24;

  const LcmTypes& types_;
  const std::vector<std::string>& places_;
  Bytes rest_;
  std::vector<double> values_;
  std::int64_t walked_ = 0;
};

void LcmTypes::Add(const std::string& path) { AddText(path, ReadWhole(path, kLargestTypeFile)); }

void LcmTypes::AddText(const std::string& path, const std::string& text) {
  Parser(path, text, structs_).Parse();
  by_fingerprint_.clear();
}

// A name without a package is of the package of its user.
std::string LcmTypes::Resolved(const std::string& type, const std::string& user) const {
  const std::string own = user.substr(0, user.rfind('.') + 1) + type;
  if (structs_.contains(own)) return own;
  if (structs_.contains(type)) return type;
  throw ConfigError("type {} uses {}, which no given .lcm file defines", user, type);
}

std::uint64_t LcmTypes::HashOf(const std::string& type, std::vector<std::string>& outer, int& hashed) const {
  if (std::ranges::find(outer, type) != outer.end()) return 0;
  if (outer.size() > kDeepestType || ++hashed > kMostHashed)
    throw ConfigError("type {} nests too much: more than {} types in one another, or {} in all",
                      outer.empty() ? type : outer.front(), kDeepestType, kMostHashed);
  std::int64_t own = 0x12345678;
  for (const Member& member : structs_.at(type).members) {
    own = Updated(own, member.name);
    if (PrimitiveOf(member.type)) own = Updated(own, member.type);
    own = Updated(own, static_cast<char>(member.dimensions.size()));
    for (const Dimension& dimension : member.dimensions) {
      own = Updated(own, static_cast<char>(dimension.is_constant ? 0 : 1));
      own = Updated(own, dimension.size);
    }
  }
  outer.push_back(type);
  auto hash = static_cast<std::uint64_t>(own);
  for (const Member& member : structs_.at(type).members)
    if (!PrimitiveOf(member.type)) hash += HashOf(Resolved(member.type, type), outer, hashed);
  outer.pop_back();
  return std::rotl(hash, 1);
}

std::optional<std::string> LcmTypes::TypeOf(Bytes message) const {
  if (by_fingerprint_.empty())
    for (const auto& [name, type] : structs_) {
      std::vector<std::string> outer;
      int hashed = 0;
      by_fingerprint_.emplace(HashOf(name, outer, hashed), name);
    }
  if (message.size() < 8) return std::nullopt;
  const auto found = by_fingerprint_.find(BigEndian(message.first(8)));
  return found == by_fingerprint_.end() ? std::nullopt : std::optional(found->second);
}

std::optional<std::vector<double>> LcmTypes::Read(const std::string& type, const std::vector<std::string>& places,
                                                  Bytes message) const {
  for (const std::string& place : places) {
    // Without indices, member by member.
    std::string user = type, member_name;
    for (std::size_t begin = 0; begin <= place.size();) {
      const std::size_t end = std::min(place.find('.', begin), place.size());
      member_name = place.substr(begin, std::min(place.find('[', begin), end) - begin);
      const auto known = structs_.find(user);
      if (known == structs_.end()) throw ConfigError("type {} is not defined", user);
      const std::vector<Member>& members = known->second.members;
      const auto member = std::ranges::find(members, member_name, &Member::name);
      const bool is_last = end == place.size();
      if (member == members.end() || member->type == "string" || is_last != (PrimitiveOf(member->type) != nullptr))
        throw ConfigError("type {} has no number {}", type, place);
      if (!is_last) user = Resolved(member->type, user);
      begin = end + 1;
    }
  }
  return Walker(*this, places, message.size() < 8 ? Bytes() : message.subspan(8)).Walk(type);
}

}  // namespace forereach
