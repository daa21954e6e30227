#include "clients/tubectl/check/aurora_assumptions.hpp"

#include "clients/tubectl/check/aurora_start_judgements.hpp"
#include "clients/tubectl/check/aurora_tracking_judgements.hpp"
#include "drivers/aurora/port_replies.hpp"

namespace tubed {

using namespace judging;  // NOLINT: one line a judgement below

const std::vector<Assumption>& aurora_assumptions() {
  static const std::vector<Assumption> assumptions{
      {"A1", "A reply ends with the CRC-16/ARC of its payload.", "recorded", check_sums},
      {"A2", "A command may be sent without check sum: NAME, blank, parameters.", "client",
       form_without_check_sum},
      {"A3", "Each command has one reply; nothing but RESET comes unasked.", "client", one_reply_a_command},
      {"A4", "A serial break is answered by RESET within 2.5 s.", "recorded", reset_after_break},
      {"A5", "COMM is answered at the old rate, then the new one holds.", "recorded", comm_at_old_rate},
      {"A6", "The tracker has 230400 baud (COMM:A0000).", "guide", has_230400},
      {"A7", "The tracker has 921600 baud (COMM:60000).", "guide", has_921600},
      {"A8", "APIREV begins with D, the Aurora's family.", "recorded", family_d},
      {"A9", "VER:0 or VER:4 has the firmware behind \"Freeze Tag:\".", "recorded", freeze_tag},
      {"A10", "GET:Info.Timeout.PINIT gives the tracker's own time-out.", "assumed", own_timeouts},
      {"A11", "PHSR lists each handle with three digits of status.", "recorded", handle_lists},
      {"A12", "Before PINIT a handle is occupied, not initialised, not enabled.", "recorded",
       status_before_pinit},
      {"A13", "PINIT is answered within 5 s, also when it fails.", "recorded", pinit_time},
      {"A14", "One PINIT initialises both coils of a plug.", "recorded", second_coil_of_plug},
      {"A15", "Both coils of a plug have one serial; port and channel differ.", "recorded", serials_of_plug},
      {"A16", "PHINF fields 0001, 0004, 0020 have 33, 20, 14 characters.", "client", tool_fields},
      {"A17", "TSTART and TSTOP are answered within 5 s.", "recorded", start_and_stop_time},
      {"A18", "The first reply after TSTART is MISSING with frame 0.", "recorded", first_reply_is_missing},
      {"A19", "BX replies have the layout of this README.", "vendor", bx_layout},
      {"A20", "TX replies have the layout of this README.", "recorded", tx_layout},
      {"A21", "A handle that is not enabled is listed too, as DISABLED.", "recorded", lists_disabled_handles},
      {"A22", "A 5-DOF coil has qz = 0 and q0 not negative.", "recorded", min_turn},
      {"A23", "All coils of a reply have the same frame number.", "recorded", one_frame_a_reply},
      {"A24", "The frame number goes up in steps of 8.", "recorded", counts_by_8},
      {"A25", "There are 40 measurements a second.", "recorded", forty_a_second},
      {"A26", "Polled faster than it measures, it repeats the last measurement.", "recorded",
       repeats_measurements},
      {"A27", "A reply to BX begins within 5 ms of the command's end.", "assumed", begins_soon},
      {"A28", "The frame number goes on over TSTOP and TSTART.", "recorded", counter_goes_on},
      {"A29", "It goes on by time: pauses are counted.", "assumed", counter_goes_by_time},
      {"A30", "TSTART:80 counts from 0 again.", "guide", option_80_counts_anew},
      {"A31", "PHSR is refused while tracking (ERROR0C).", "assumed", phsr_while_tracking},
      {"A32", "PHINF is answered while tracking.", "assumed", phinf_while_tracking},
      {"A33", "VER and COMM are answered while tracking.", "assumed", ver_and_comm_while_tracking},
      {"A34", "PINIT and PDIS are refused while tracking (ERROR0C).", "assumed",
       pinit_and_pdis_while_tracking},
      {"A35", "INIT is refused while tracking (ERROR0C).", "assumed", init_while_tracking},
      {"A36", "A command sent while a reply leaves spoils neither reply.", "assumed", command_during_reply},
      {"A37", "A pulled plug is DISABLED in the next replies, status 0080.", "recorded", pulled_plug},
      {"A38", "A plug put in sets status 0040; PHSR:02 lists it after TSTOP.", "recorded", plug_put_in},
  };
  return assumptions;
}

std::string tracker_name(const WireConversation& conversation) {
  std::string firmware = "firmware not said";
  std::string revision;
  for (const WireTurn& turn : conversation.turns) {
    const auto said =
        turn.reply && turn.name == "VER" ? aurora::find_firmware(turn.reply->payload) : std::nullopt;
    if (said) {
      firmware = *said;
    } else if (turn.reply && turn.name == "APIREV" && aurora::parse_api_revision(turn.reply->payload)) {
      revision = ", API " + turn.reply->payload;
    }
  }
  return firmware + revision;
}

std::vector<JudgedAssumption> judge_assumptions(const WireConversation& conversation) {
  std::vector<JudgedAssumption> judged_all;
  for (const Assumption& assumption : aurora_assumptions()) {
    judged_all.push_back({&assumption, assumption.judge(conversation)});
  }
  return judged_all;
}

}  // namespace tubed
