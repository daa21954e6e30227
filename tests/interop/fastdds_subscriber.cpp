// Another vendor's subscriber: receives one sample of each topic and compares every field with the distinct
// values; with DDS Security when a folder of keys is given. Exit code 0: all right, 1: a field differs or a
// topic did not come within 15 s; every difference is printed.
#include <array>
#include <chrono>
#include <cstdio>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <type_traits>

#include "EmSamplesPubSubTypes.h"
#include "TubeEstimatePubSubTypes.h"
#include "TubeHealthPubSubTypes.h"
#include "TubeIdentityPubSubTypes.h"
#include "TubeStatusPubSubTypes.h"
#include "idl/wire_fields.h"

namespace fast = eprosima::fastdds::dds;

namespace {

int differences = 0;

template <typename A, typename B>
void expect_equal(const char* field, const A& received, const B& expected) {
  if (!(received == static_cast<A>(expected))) {
    std::printf("DIFFERENT: %s\n", field);
    ++differences;
  }
}

void expect_text(const char* field, const std::string& received, const std::string& expected) {
  if (received != expected) {
    std::printf("DIFFERENT: %s is '%s', not '%s'\n", field, received.c_str(), expected.c_str());
    ++differences;
  }
}

/// Element k must be first + k * step: how the distinct values fill arrays.
template <typename Array>
void expect_series(const char* field, const Array& received, double first, double step = 1.0 / 8) {
  for (std::size_t k = 0; k < received.size(); ++k) {
    expect_equal(field, static_cast<double>(received[k]), first + static_cast<double>(k) * step);
  }
}

void check_histogram(const tubed::LatencyHistogram& histogram, unsigned count, int max_ns, int first) {
  expect_equal("histogram count", histogram.count(), count);
  expect_equal("histogram max_ns", histogram.max_ns(), max_ns);
  expect_series("histogram buckets", histogram.buckets(), first, 1);
}

void check_stamps(const tubed::StageStamps& stamps) {
  expect_equal("exposure", stamps.exposure_monotonic_ns(), 111);
  expect_equal("image_grabbed", stamps.image_grabbed_monotonic_ns(), 112);
  expect_equal("frangi_started", stamps.frangi_started_monotonic_ns(), 113);
  expect_equal("frangi_finished", stamps.frangi_finished_monotonic_ns(), 114);
  expect_equal("em_measured", stamps.em_measured_monotonic_ns(), 115);
  expect_equal("em_received", stamps.em_received_monotonic_ns(), 116);
  expect_equal("optimizer_started", stamps.optimizer_started_monotonic_ns(), 117);
  expect_equal("optimizer_finished", stamps.optimizer_finished_monotonic_ns(), 118);
  expect_equal("publish_started", stamps.publish_started_monotonic_ns(), 1'000'000);
}

void check_shape(const tubed::TubeEstimate& estimate) {
  expect_equal("point_count", estimate.point_count(), 128);
  for (std::size_t i = 0; i < estimate.points().size(); ++i) {
    const auto number = static_cast<double>(i);
    expect_series("p_world_mm", estimate.points()[i].p_world_mm(), 1000 + number);
    expect_series("tangent_world", estimate.points()[i].tangent_world(), 2000 + number);
    expect_series("covariance_mm2", estimate.points()[i].covariance_mm2(), 3000 + number);
    expect_equal("held_by", estimate.points()[i].held_by(), i % 4);
  }
  expect_equal("coefficient_count", estimate.coefficient_count(), 64);
  expect_equal("coefficient_spacing_mm", estimate.coefficient_spacing_mm(), 110);
  for (std::size_t i = 0; i < estimate.coefficients_mm().size(); ++i) {
    expect_series("coefficients_mm", estimate.coefficients_mm()[i], 4000 + static_cast<double>(i));
  }
  expect_equal("coil_count", estimate.coil_count(), 16);
  for (std::size_t i = 0; i < estimate.coils().size(); ++i) {
    const tubed::CoilResidual& coil = estimate.coils()[i];
    expect_equal("coil state", coil.state(), i % 6);
    expect_equal("offset_from_tip_mm", coil.offset_from_tip_mm(), 5000 + i);
    expect_equal("position_mm", coil.position_mm(), 6000 + i);
    expect_equal("angle_rad", coil.angle_rad(), 7000 + i);
  }
  expect_equal("view_count", estimate.view_count(), 4);
  for (std::size_t i = 0; i < estimate.views().size(); ++i) {
    const tubed::ViewUsed& view = estimate.views()[i];
    const auto number = static_cast<double>(i);
    expect_equal("view's camera", view.camera(), 3 - i);
    expect_equal("view's has_own_geometry", view.has_own_geometry(), i % 2 == 1);
    expect_equal("view's exposure", view.exposure_monotonic_ns(), 20000 + i);
    expect_series("view's focal_length_px", view.focal_length_px(), 21000 + number);
    expect_series("view's principal_point_px", view.principal_point_px(), 22000 + number);
    expect_series("view's T_camera_world", view.T_camera_world(), 23000 + number);
    expect_series("view's sigma_rotation_rad", view.sigma_rotation_rad(), 24000 + number);
    expect_series("view's sigma_translation_mm", view.sigma_translation_mm(), 25000 + number);
  }
}

/// A number is not zero and no other field's: also of fields that are not named below.
struct NumbersApart {
  std::set<double> seen;
  template <typename Field>
  void operator()(const char* name, const Field& field) {
    if constexpr (std::is_arithmetic_v<Field> && !std::is_same_v<Field, bool>) {
      expect_equal(name, field != Field{} && seen.insert(static_cast<double>(field)).second, true);
    }
  }
};

void check_numbers_apart(const tubed::TubeEstimate& estimate) {
  NumbersApart apart;
#define TUBED_FIELD(field) apart(#field, estimate.field());
#define TUBED_LIST(list, count)
  TUBED_FIELDS_OF_TubeEstimate(TUBED_FIELD, TUBED_LIST)
#undef TUBED_FIELD
#undef TUBED_LIST
}

void check(const tubed::TubeEstimate& estimate) {
  check_numbers_apart(estimate);
  expect_text("instrument_id", estimate.instrument_id().to_string(), "catheter");
  expect_equal("sequence_number", estimate.sequence_number(), 101);
  expect_equal("daemon_start drawn", estimate.daemon_start() != 0, true);
  expect_equal("valid_time_ns", estimate.valid_time_ns(), 4'000'102);
  expect_equal("valid_time_monotonic_ns", estimate.valid_time_monotonic_ns(), 102);
  expect_equal("publish_time_ns", estimate.publish_time_ns(), 5'000'000);
  expect_equal("validity", estimate.validity(), tubed::VALIDITY_QUESTIONABLE);
  expect_equal("reasons", estimate.reasons(),
               tubed::REASON_COIL_LOST | tubed::REASON_IMAGE_OFF | tubed::REASON_RIVAL_WRITER);
  expect_equal("has_image", estimate.has_image(), true);
  expect_equal("is_image_instant", estimate.is_image_instant(), false);
  expect_equal("image_frame", estimate.image_frame(), 103);
  expect_equal("em_frame", estimate.em_frame(), 104);
  expect_equal("em_age_ns", estimate.em_age_ns(), 105);
  expect_equal("image_age_ns", estimate.image_age_ns(), 106);
  expect_equal("radius_mm", estimate.radius_mm(), 107);
  expect_equal("length_mm", estimate.length_mm(), 108);
  expect_equal("image_inlier_ratio", estimate.image_inlier_ratio(), 0.25);
  expect_equal("in_view_ratio", estimate.in_view_ratio(), 0.5);
  expect_equal("iterations", estimate.iterations(), 109);
  check_shape(estimate);
  check_stamps(estimate.stamps());
}

void check(const tubed::EmSamples& samples) {
  expect_text("instrument_id", samples.instrument_id().to_string(), "catheter");
  expect_equal("sequence_number", samples.sequence_number(), 201);
  expect_equal("daemon_start drawn", samples.daemon_start() != 0, true);
  expect_equal("measured_ns", samples.measured_ns(), 4'000'202);
  expect_equal("measured_monotonic_ns", samples.measured_monotonic_ns(), 202);
  expect_equal("received_monotonic_ns", samples.received_monotonic_ns(), 203);
  expect_equal("tracker_frame", samples.tracker_frame(), 204);
  expect_equal("origin", samples.origin(), 2);
  expect_equal("coil_count", samples.coil_count(), 16);
  for (std::size_t i = 0; i < samples.coils().size(); ++i) {
    const auto number = static_cast<double>(i);
    expect_equal("status", samples.coils()[i].status(), i % 4);
    expect_series("p_em_mm", samples.coils()[i].p_em_mm(), 8000 + number);
    expect_series("tangent_em", samples.coils()[i].tangent_em(), 9000 + number);
    expect_equal("indicator", samples.coils()[i].indicator(), 10000 + i);
  }
}

void check(const tubed::TubeStatus& status) {
  expect_text("instrument_id", status.instrument_id().to_string(), "catheter");
  expect_equal("daemon_start drawn", status.daemon_start() != 0, true);
  expect_equal("time_ns", status.time_ns(), 5'000'000);
  expect_equal("validity", status.validity(), tubed::VALIDITY_VALID);
  expect_equal("reasons", status.reasons(), 7);
  expect_equal("estimate_age_ns", status.estimate_age_ns(), 310);
  expect_equal("stage_count", status.stage_count(), 1);
  expect_text("name", status.stages()[0].name().to_string(), "Frangi");
  expect_equal("state", status.stages()[0].state(), 2);
  expect_equal("since_ns", status.stages()[0].since_ns(), 4'000'301);
  expect_equal("age_ns", status.stages()[0].age_ns(), 600'000);
  expect_text("why", status.stages()[0].why().to_string(), "half of the images are black");
}

void check(const tubed::EmImageAgreement& agreement) {
  expect_equal("disagree", agreement.disagree(), true);
  expect_equal("explanation", agreement.explanation(), 7);
  expect_equal("index", agreement.index(), 508);
  expect_equal("probability", agreement.probability(), 0.75);
  expect_equal("as_stated", agreement.as_stated(), 0.125);
  expect_series("shift_mm", agreement.shift_mm(), 520);
  expect_series("turn_rad", agreement.turn_rad(), 530);
  expect_equal("unsure_mm", agreement.unsure_mm(), 513);
  expect_equal("unsure_rad", agreement.unsure_rad(), 514);
  expect_series("coil_mm", agreement.coil_mm(), 540);
  expect_equal("arc_length_mm", agreement.arc_length_mm(), 509);
  expect_equal("end_mm", agreement.end_mm(), 510);
  expect_equal("clock_s", agreement.clock_s(), 511);
  expect_equal("magnification", agreement.magnification(), 512);
}

void check(const tubed::TubeHealth& health) {
  expect_text("instrument_id", health.instrument_id().to_string(), "catheter");
  expect_equal("daemon_start drawn", health.daemon_start() != 0, true);
  expect_equal("time_ns", health.time_ns(), 5'000'000);
  expect_equal("estimates", health.estimates(), 501);
  expect_series("validity_counts", health.validity_counts(), 502, 1);
  check_histogram(health.exposure_to_publish(), 506, 507, 600);
  check(health.agreement());
  expect_equal("stage_count", health.stage_count(), 1);
  const tubed::StageHealth& stage = health.stages()[0];
  expect_text("name", stage.name().to_string(), "Frangi");
  expect_equal("steps", stage.steps(), 302);
  expect_equal("outputs", stage.outputs(), 303);
  expect_equal("dropped", stage.dropped(), 304);
  expect_equal("refused", stage.refused(), 305);
  expect_equal("reconnects", stage.reconnects(), 306);
  expect_equal("allocations", stage.allocations(), 307);
  expect_equal("allocations_counted", stage.allocations_counted(), true);
  check_histogram(stage.busy(), 308, 309, 400);
}

void check_tracker(const tubed::TrackerIdentity& tracker) {
  expect_text("firmware", tracker.firmware().to_string(), "AURORA Rev 008");
  expect_text("api_revision", tracker.api_revision().to_string(), "D.001.007");
  expect_text("control_unit_serial", tracker.control_unit_serial().to_string(), "P5-00807");
  expect_text("field_generator", tracker.field_generator().to_string(), "SC-00808");
  expect_equal("tool_count", tracker.tool_count(), 2);
  expect_equal("tool port", tracker.tools()[1].port(), 812);
  expect_equal("tool serial_number", tracker.tools()[1].serial_number(), 813);
  expect_text("tool part_number", tracker.tools()[1].part_number().to_string(), "610814");
}

void check(const tubed::TubeIdentity& identity) {
  expect_text("instrument_id", identity.instrument_id().to_string(), "catheter");
  expect_equal("daemon_start drawn", identity.daemon_start() != 0, true);
  expect_text("software_version", identity.software_version().to_string(), "1.2.3");
  expect_text("configuration_digest", identity.configuration_digest().to_string(), std::string(64, 'd'));
  expect_text("mode", identity.mode().to_string(), "em");
  expect_equal("diameter_mm", identity.diameter_mm(), 801);
  expect_equal("length_mm", identity.length_mm(), 802);
  expect_equal("coil_count", identity.coil_count(), 3);
  for (std::size_t i = 0; i < 3; ++i) {
    expect_equal("coil_offsets_from_tip_mm", identity.coil_offsets_from_tip_mm()[i], 803 + i);
  }
  expect_series("T_world_em", identity.T_world_em(), 900);
  expect_equal("registration_residual_mm", identity.registration_residual_mm(), 806);
  expect_text("world_frame", identity.world_frame().to_string(), "table top");
  expect_text("world_axes", identity.world_axes().to_string(), "LPS");
  expect_equal("camera_count", identity.camera_count(), 1);
  const tubed::CameraIdentity& camera = identity.cameras()[0];
  expect_text("camera name", camera.name().to_string(), "frontal");
  expect_equal("width", camera.width(), 640);
  expect_equal("height", camera.height(), 480);
  expect_series("focal_length_px", camera.focal_length_px(), 1000, 1);
  expect_series("principal_point_px", camera.principal_point_px(), 320.5, -80);
  const std::array<double, 5> distortion{0.1, 0.2, 0.3, 0.4, 0.5};
  expect_equal("distortion", camera.distortion(), distortion);
  expect_series("T_camera_world", camera.T_camera_world(), 700);
  check_tracker(identity.tracker());
}

/// Subscribes with the contract's QoS, waits for one sample and checks it.
template <typename Type, typename Sample>
void receive(fast::DomainParticipant& participant, const char* topic_name, bool is_late_joiner_served) {
  fast::TypeSupport type(new Type());
  type.register_type(&participant);
  fast::Topic* topic = participant.create_topic(topic_name, type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
  fast::Subscriber* subscriber = participant.create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
  fast::DataReaderQos qos = fast::DATAREADER_QOS_DEFAULT;
  qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  qos.durability().kind =
      is_late_joiner_served ? fast::TRANSIENT_LOCAL_DURABILITY_QOS : fast::VOLATILE_DURABILITY_QOS;
  fast::DataReader* reader = subscriber->create_datareader(topic, qos);
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(15);
  const auto sample = std::make_unique<Sample>();
  fast::SampleInfo about;
  while (reader == nullptr || reader->take_next_sample(sample.get(), &about) != ReturnCode_t::RETCODE_OK ||
         !about.valid_data) {
    if (reader == nullptr || std::chrono::steady_clock::now() > until) {
      std::printf("NOTHING RECEIVED: %s\n", topic_name);
      ++differences;
      return;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  const int before = differences;
  check(*sample);
  std::printf("%s: %s\n", topic_name, differences == before ? "every field right" : "WRONG");
}

/// Fast DDS's own plug-ins with the files that `tubectl keys` made.
fast::DomainParticipantQos secured(const std::string& folder) {
  fast::DomainParticipantQos qos = fast::PARTICIPANT_QOS_DEFAULT;
  auto& properties = qos.properties().properties();
  const auto set_file = [&](const char* property, const char* file) {
    properties.emplace_back(property, "file://" + folder + "/" + file);
  };
  properties.emplace_back("dds.sec.auth.plugin", "builtin.PKI-DH");
  set_file("dds.sec.auth.builtin.PKI-DH.identity_ca", "identity_ca.pem");
  set_file("dds.sec.auth.builtin.PKI-DH.identity_certificate", "identity.pem");
  set_file("dds.sec.auth.builtin.PKI-DH.private_key", "identity.key");
  properties.emplace_back("dds.sec.access.plugin", "builtin.Access-Permissions");
  set_file("dds.sec.access.builtin.Access-Permissions.permissions_ca", "permissions_ca.pem");
  set_file("dds.sec.access.builtin.Access-Permissions.governance", "governance.p7s");
  set_file("dds.sec.access.builtin.Access-Permissions.permissions", "permissions.p7s");
  properties.emplace_back("dds.sec.crypto.plugin", "builtin.AES-GCM-GMAC");
  return qos;
}

}  // namespace

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);  // what is said so far is read, however this ends
  fast::DomainParticipant* participant = fast::DomainParticipantFactory::get_instance()->create_participant(
      0, argc > 1 ? secured(argv[1]) : fast::PARTICIPANT_QOS_DEFAULT);
  if (participant == nullptr) {
    std::puts("cannot create a participant");
    return 1;
  }
  receive<tubed::TubeEstimatePubSubType, tubed::TubeEstimate>(*participant, "TubeEstimate", false);
  receive<tubed::EmSamplesPubSubType, tubed::EmSamples>(*participant, "EmSamples", false);
  receive<tubed::TubeStatusPubSubType, tubed::TubeStatus>(*participant, "TubeStatus", true);
  receive<tubed::TubeIdentityPubSubType, tubed::TubeIdentity>(*participant, "TubeIdentity", true);
  receive<tubed::TubeHealthPubSubType, tubed::TubeHealth>(*participant, "TubeHealth", false);
  participant->delete_contained_entities();
  fast::DomainParticipantFactory::get_instance()->delete_participant(participant);
  return differences == 0 ? 0 : 1;
}
