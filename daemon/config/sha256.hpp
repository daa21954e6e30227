// The fingerprint by which a subscriber knows two configurations apart.
#pragma once

#include <string>
#include <string_view>

namespace tubed {

/// SHA-256 of `bytes` (FIPS 180-4) as 64 hexadecimal digits, lower case.
std::string sha256_hex(std::string_view bytes);

}  // namespace tubed
