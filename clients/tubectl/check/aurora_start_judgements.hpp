// What a conversation says about framing, the line, and ports before tracking. Each function judges one
// assumption of drivers/aurora/README.md. Pure.
#pragma once

#include "clients/tubectl/check/aurora_judgement.hpp"

namespace tubed::judging {

Judgement check_sums(const WireConversation& conversation);
Judgement form_without_check_sum(const WireConversation& conversation);
Judgement one_reply_a_command(const WireConversation& conversation);
Judgement reset_after_break(const WireConversation& conversation);
Judgement comm_at_old_rate(const WireConversation& conversation);
Judgement has_230400(const WireConversation& conversation);
Judgement has_921600(const WireConversation& conversation);
Judgement family_d(const WireConversation& conversation);
Judgement freeze_tag(const WireConversation& conversation);
Judgement own_timeouts(const WireConversation& conversation);
Judgement handle_lists(const WireConversation& conversation);
Judgement status_before_pinit(const WireConversation& conversation);
Judgement pinit_time(const WireConversation& conversation);
Judgement second_coil_of_plug(const WireConversation& conversation);
Judgement serials_of_plug(const WireConversation& conversation);
Judgement tool_fields(const WireConversation& conversation);
Judgement start_and_stop_time(const WireConversation& conversation);

}  // namespace tubed::judging
