#pragma once

#include <string>
#include <string_view>

namespace anchorsplat {

// Text of unknown origin as HTML text or as the value of a quoted attribute: & < > " ' become references.
std::string EscapeHtml(std::string_view text);

// JSON that may stand inside a <script> element: < > & (which can end or reopen it) and the two line separators that
// JavaScript once did not allow in strings become \u escapes. The value stays the same.
std::string EscapeJsonForScript(std::string_view json);

}  // namespace anchorsplat
