// Any text through everything that reads text: payloads whose check sum a fuzzer would hardly guess, and
// commands.
#include <cstdlib>
#include <vector>

#include "drivers/aurora/bx_reply.hpp"
#include "drivers/aurora/command.hpp"
#include "drivers/aurora/port_replies.hpp"
#include "drivers/aurora/reply.hpp"
#include "drivers/aurora/tx_reply.hpp"

using namespace tubed::aurora;

namespace {

void demand(bool held) {
  if (!held) {
    std::abort();
  }
}

void check_poses(const TrackingReply& reply) {
  demand(reply.handle_count >= 0 && reply.handle_count <= kMaxHandles);
  for (const HandleReading& reading : reply.readings()) {
    demand(reading.report != Report::kValid || plausible_pose(reading));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::vector<std::uint8_t> exact(data, data + size);
  const std::string_view text = as_text(exact);
  TrackingReply reply;
  if (decode_tx(text, reply)) {
    check_poses(reply);
  }
  if (decode_bx(exact, reply)) {
    check_poses(reply);
  }
  if (const auto list = parse_handle_list(text)) {
    demand(list->count <= kMaxHandles);
  }
  for (const std::uint16_t fields : {kToolField, kLocationField, kPartNumberField}) {
    static_cast<void>(parse_tool(text, fields));
  }
  static_cast<void>(parse_tool(text, kToolField | kPartNumberField | kLocationField));
  static_cast<void>(parse_api_revision(text));
  static_cast<void>(parse_link_parameters(text));
  if (const auto firmware = find_firmware(text)) {
    demand(!firmware->empty());
  }
  static_cast<void>(find_user_parameter(text, "Info.Timeout.PINIT"));
  static_cast<void>(decode_text_reply(text));
  static_cast<void>(decode_word_at_end(text));
  if (const auto command = parse_command(text)) {
    demand(command->name.size() + command->parameters.size() < text.size());
  }
  return 0;
}
