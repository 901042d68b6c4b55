#pragma once

#include <string>
#include <string_view>

namespace anchorsplat {

// Escapes untrusted text for HTML text or a quoted attribute: & < > " '.
std::string EscapeHtml(std::string_view text);

// Escapes JSON for a <script> element: < > & (which can end or reopen it) and the two line separators that older
// JavaScript forbids in strings become \u escapes. The value is unchanged.
std::string EscapeJsonForScript(std::string_view json);

}  // namespace anchorsplat
