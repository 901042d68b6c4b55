#include "enhance/method_option.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "core/number_text.h"
#include "core/text.h"
#include "enhance/enhance.h"

namespace anchorsplat {

namespace {

template <class T>
struct NumberOf {
  using Type = T;
};
template <class T>
struct NumberOf<std::optional<T>> {
  using Type = T;
};

Status Assign(const MethodOption& option, const std::string& text, EnhanceOptions& options) {
  const auto bad = [&](const std::string& expected) {
    return Error{ErrorCode::kBadArgument,
                 Cat(option.name, " cannot be '", Printable(text), "': it must be ", expected)};
  };
  OptionValue value = option.value(options);
  return std::visit(
      [&]<class Value>(Value& to) -> Status {
        if constexpr (std::is_same_v<Value, WordOption>) {
          if (to.choices.empty() || std::ranges::count(to.choices, text) > 0) return to.set(text);
          return bad(OrList(to.choices));
        } else if constexpr (std::is_same_v<Value, std::filesystem::path*>) {
          if (text.empty()) return bad("a file");
          *to = text;
        } else {
          using Number = typename NumberOf<std::remove_pointer_t<Value>>::Type;
          constexpr bool whole = std::is_integral_v<Number>;
          constexpr double most = std::min(1e15, static_cast<double>(std::numeric_limits<Number>::max()));
          double number = 0;
          const auto [stop, code] = FromChars(text.data(), text.data() + text.size(), number);
          const bool fits = code == std::errc() && stop == text.data() + text.size() && std::isfinite(number) &&
                            (!whole || (number == std::floor(number) && std::abs(number) <= most));
          if constexpr (std::is_same_v<Number, bool>) {
            if (!fits || number < 0) return bad("0 or 1");
          } else if (!fits || !Contains(option.range, number)) {
            return bad(Describe(option.range, whole));
          }
          *to = static_cast<Number>(number);
        }
        return {};
      },
      value);
}

}  // namespace

bool Contains(const OptionRange& range, double number) {
  return number <= range.greatest && (range.above_least ? number > range.least : number >= range.least);
}

std::string Describe(const OptionRange& range, bool whole) {
  const std::string text = whole ? "a whole number" : "a number";
  if (range.least == OptionRange().least) return text;
  const bool bounded = range.greatest != OptionRange().greatest;
  const auto least = static_cast<int64_t>(range.least), greatest = static_cast<int64_t>(range.greatest);
  if (range.above_least) return Cat(text, " above ", least, bounded ? Cat(" and at most ", greatest) : "");
  return bounded ? Cat(text, " from ", least, " to ", greatest) : Cat(text, " of ", least, " or more");
}

std::string OrList(const std::vector<std::string>& words) {
  std::string list;
  for (size_t i = 0; i < words.size(); ++i) list += (i == 0 ? "" : i + 1 == words.size() ? " or " : ", ") + words[i];
  return list;
}

Status SetOption(const std::vector<MethodOption>& known, const std::string& name, const std::string& text,
                 EnhanceOptions& options) {
  const std::string_view now = name == "most-gaussians" ? "max-gaussians" : std::string_view(name);  // former name
  std::string names;
  for (const MethodOption& option : known) {
    if (!option.value) continue;
    if (option.name == now) {
      ANCHORSPLAT_RETURN_IF_ERROR(Assign(option, text, options));
      options.given.push_back(option.name);
      return {};
    }
    names += Cat(names.empty() ? "" : ", ", option.name);
  }
  return Error{ErrorCode::kBadArgument, Cat("there is no option '", Printable(name), "' (known: ", names, ")")};
}

Status CheckRanges(const std::vector<MethodOption>& known, EnhanceOptions& options) {
  for (const MethodOption& option : known) {
    if (!option.value) continue;
    const std::string wrong = std::visit(
        [&](auto value) -> std::string {
          if constexpr (std::is_pointer_v<decltype(value)>) {
            using T = std::remove_pointer_t<decltype(value)>;
            using Number = typename NumberOf<T>::Type;
            if constexpr (std::is_arithmetic_v<Number>) {
              const std::optional<Number> number = *value;
              if (!number || Contains(option.range, static_cast<double>(*number))) return "";
              return Cat("--", option.name, " ", *number, ": it must be ",
                         Describe(option.range, std::is_integral_v<Number>));
            }
          }
          return "";
        },
        option.value(options));
    if (!wrong.empty()) return Error{ErrorCode::kBadArgument, wrong};
  }
  return {};
}

}  // namespace anchorsplat
