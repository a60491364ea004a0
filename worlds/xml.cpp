#include "worlds/xml.h"

#include <expat.h>

#include <algorithm>
#include <exception>

#include <fmt/format.h>

#include "task/config_error.h"

namespace forereach {
namespace {

// The tree is freed by calls as deep as it is.
constexpr std::size_t kDeepest = 64;

// Expat's callbacks are called from C: an exception waits until the parser has returned.
class TreeBuilder {
 public:
  explicit TreeBuilder(const std::string& file) : file_(file) {
    if (!parser_) throw std::bad_alloc();
    XML_SetUserData(parser_.get(), this);
    XML_SetElementHandler(parser_.get(), &TreeBuilder::Begin, &TreeBuilder::End);
    XML_SetCharacterDataHandler(parser_.get(), &TreeBuilder::Characters);
    // What it refuses brings entities, which can name files and grow without end.
    XML_SetStartDoctypeDeclHandler(parser_.get(), &TreeBuilder::Doctype);
  }

  std::unique_ptr<XmlElement> Read(std::string_view bytes) {
    if (bytes.size() > kLargest) Fail(1, "is too large");
    const XML_Status status = XML_Parse(parser_.get(), bytes.data(), static_cast<int>(bytes.size()), XML_TRUE);
    if (failure_) std::rethrow_exception(failure_);
    if (status != XML_STATUS_OK) Fail(Line(), "is no XML that can be read");
    return std::move(root_);
  }

 private:
  static constexpr std::size_t kLargest = std::size_t{1} << 30;

  [[noreturn]] void Fail(int line, const std::string& what) const { throw ConfigError("{}:{}: {}", file_, line, what); }
  [[nodiscard]] int Line() const { return static_cast<int>(XML_GetCurrentLineNumber(parser_.get())); }

  template <class Action>
  static void Guarded(void* self, const Action& action) noexcept {
    auto& builder = *static_cast<TreeBuilder*>(self);
    if (builder.failure_) return;
    try {
      action(builder);
    } catch (...) {
      builder.failure_ = std::current_exception();
      XML_StopParser(builder.parser_.get(), XML_FALSE);
    }
  }

  static void XMLCALL Begin(void* self, const XML_Char* name, const XML_Char** attributes) noexcept {
    Guarded(self, [&](TreeBuilder& builder) { builder.Open(name, attributes); });
  }
  static void XMLCALL End(void* self, const XML_Char*) noexcept {
    Guarded(self, [](TreeBuilder& builder) { builder.open_.pop_back(); });
  }
  static void XMLCALL Characters(void* self, const XML_Char* text, int size) noexcept {
    Guarded(self, [&](TreeBuilder& builder) {
      if (!builder.open_.empty()) builder.open_.back()->text.append(text, static_cast<std::size_t>(size));
    });
  }
  static void XMLCALL Doctype(void* self, const XML_Char*, const XML_Char*, const XML_Char*, int) noexcept {
    Guarded(self, [](TreeBuilder& builder) {
      builder.Fail(builder.Line(), "a document type declaration, which is not read; delete it");
    });
  }

  void Open(const XML_Char* name, const XML_Char** attributes) {
    if (open_.size() >= kDeepest) Fail(Line(), fmt::format("elements nest deeper than {}", kDeepest));
    auto element = std::make_unique<XmlElement>();
    element->name = name;
    element->line = Line();
    for (; *attributes != nullptr; attributes += 2) element->attributes.emplace_back(attributes[0], attributes[1]);
    XmlElement* const place = element.get();
    if (open_.empty())
      root_ = std::move(element);
    else
      open_.back()->children.push_back(std::move(element));
    open_.push_back(place);
  }

  struct Free {
    void operator()(XML_Parser parser) const { XML_ParserFree(parser); }
  };

  const std::string& file_;
  const std::unique_ptr<XML_ParserStruct, Free> parser_{XML_ParserCreate(nullptr)};
  std::unique_ptr<XmlElement> root_;
  std::vector<XmlElement*> open_;
  std::exception_ptr failure_;
};

}  // namespace

const XmlElement* XmlElement::Find(std::string_view child) const {
  for (const auto& each : children)
    if (each->name == child) return each.get();
  return nullptr;
}

std::vector<const XmlElement*> XmlElement::All(std::string_view child) const {
  std::vector<const XmlElement*> found;
  for (const auto& each : children)
    if (each->name == child) found.push_back(each.get());
  return found;
}

const std::string* XmlElement::Attribute(std::string_view attribute) const {
  const auto found = std::ranges::find(attributes, attribute, &std::pair<std::string, std::string>::first);
  return found == attributes.end() ? nullptr : &found->second;
}

std::unique_ptr<XmlElement> ReadXml(const std::string& file, std::string_view bytes) {
  return TreeBuilder(file).Read(bytes);
}

}  // namespace forereach
