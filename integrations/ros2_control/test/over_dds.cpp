// The controller in a loop of 1 kHz behind Fast DDS: its topics have the names and types that ROS 2 gives them, so that a
// program over DDS of another vendor leads it. Stand-ins take the place of ROS, and an arm does what it is told.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include <fastcdr/Cdr.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

#include "arm.h"
#include "ftqp_controller/ftqp_controller.hpp"

namespace fast = eprosima::fastdds::dds;
using diagnostic_msgs::msg::DiagnosticStatus;
using diagnostic_msgs::msg::KeyValue;
using eprosima::fastcdr::Cdr;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;
using geometry_msgs::msg::PoseStamped;

namespace {

constexpr unsigned LARGEST = 4096;  // bytes of a message

// In both directions: `cdr >> x` and `cdr << x` are the same list of fields.
template <class Go> void fields(PoseStamped &m, Go go) {
    go(m.header.stamp.sec), go(m.header.stamp.nanosec), go(m.header.frame_id);
    go(m.pose.position.x), go(m.pose.position.y), go(m.pose.position.z);
    go(m.pose.orientation.x), go(m.pose.orientation.y), go(m.pose.orientation.z), go(m.pose.orientation.w);
}
template <class Go> void fields(KeyValue &m, Go go) { go(m.key), go(m.value); }
template <class Go> void fields(std_msgs::msg::String &m, Go go) { go(m.data); }
template <class Go> void fields(DiagnosticStatus &m, Go go) {
    go(m.level), go(m.name), go(m.message), go(m.hardware_id);
    auto count = static_cast<std::uint32_t>(m.values.size());
    go(count);
    m.values.resize(count);
    for (auto &value : m.values) fields(value, go);
}

template <class Message> class TypeOf : public fast::TopicDataType {
public:
    explicit TypeOf(const std::string &name) {
        setName(name.c_str());
        m_typeSize = LARGEST;
        m_isGetKeyDefined = false;
    }
    bool serialize(void *data, SerializedPayload_t *payload) override {
        eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char *>(payload->data), payload->max_size);
        Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
        payload->encapsulation = CDR_LE;
        cdr.serialize_encapsulation();
        fields(*static_cast<Message *>(data), [&cdr](auto &field) { cdr << field; });
        payload->length = static_cast<std::uint32_t>(cdr.getSerializedDataLength());
        return true;
    }
    bool deserialize(SerializedPayload_t *payload, void *data) override {
        try {
            eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char *>(payload->data), payload->length);
            Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
            cdr.read_encapsulation();
            fields(*static_cast<Message *>(data), [&cdr](auto &field) { cdr >> field; });
            return true;
        } catch (const eprosima::fastcdr::exception::Exception &) {
            return false;
        }
    }
    std::function<std::uint32_t()> getSerializedSizeProvider(void *) override {
        return [] { return LARGEST; };
    }
    void *createData() override { return new Message; }
    void deleteData(void *data) override { delete static_cast<Message *>(data); }
    bool getKey(void *, InstanceHandle_t *, bool) override { return false; }
};

class Wire {
public:
    explicit Wire(unsigned domain) {
        fast::DomainParticipantQos qos;  // this machine only, without multicast
        const auto loopback = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
        loopback->interfaceWhiteList.push_back("127.0.0.1");
        qos.transport().use_builtin_transports = false;
        qos.transport().user_transports.push_back(loopback);
        eprosima::fastrtps::rtps::Locator_t peer;
        eprosima::fastrtps::rtps::IPLocator::createLocator(LOCATOR_KIND_UDPv4, "127.0.0.1", 0, peer);
        qos.wire_protocol().builtin.initialPeersList.push_back(peer);
        participant_ = fast::DomainParticipantFactory::get_instance()->create_participant(domain, qos);
        if (!participant_) std::exit(EXIT_FAILURE);
        subscriber_ = participant_->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
        publisher_ = participant_->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
    }
    template <class Message> fast::Topic *topic(const std::string &name, const std::string &type) {
        fast::TypeSupport support(new TypeOf<Message>(type));
        support.register_type(participant_);
        return participant_->create_topic(name, type, fast::TOPIC_QOS_DEFAULT);
    }
    // A message on a topic is given to the subscription of that name.
    template <class Message> void hear(const std::string &topic_of, const std::string &type, rclcpp_lifecycle::LifecycleNode &node) {
        fast::DataReaderQos qos;
        qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
        auto *reader = subscriber_->create_datareader(topic<Message>("rt/ftqp/" + topic_of, type), qos);
        heard_.push_back([reader, topic_of, &node] {
            Message message;
            fast::SampleInfo info;
            while (reader->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK)
                if (info.valid_data) node.deliver("~/" + topic_of, message);
        });
    }
    fast::DataWriter *writer(fast::Topic *topic) {
        fast::DataWriterQos qos;
        qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
        return publisher_->create_datawriter(topic, qos);
    }
    void listen() const {
        for (const auto &one : heard_) one();
    }

private:
    fast::DomainParticipant *participant_ = nullptr;
    fast::Subscriber *subscriber_;
    fast::Publisher *publisher_;
    std::vector<std::function<void()>> heard_;
};

}  // namespace

int main(int, char **arguments) {
    const unsigned domain = static_cast<unsigned>(std::atoi(arguments[2]));
    const double seconds = std::atof(arguments[3]);
    auto &params = ftqp_controller::ParamListener::given();
    params.arm_file = arguments[1];
    params.target_timeout = 0.0;
    params.joints.assign(ftqp_arm_joints, ftqp_arm_joints + FTQP_ARM_JOINTS);

    ftqp_controller::FtqpController controller;
    double q[FTQP_ARM_JOINTS], sent[FTQP_ARM_JOINTS];
    std::vector<hardware_interface::LoanedCommandInterface> commands;
    std::vector<hardware_interface::LoanedStateInterface> states;
    for (int i = 0; i < FTQP_ARM_JOINTS; i++) {
        q[i] = sent[i] = ftqp_arm_neutral[i];
        commands.emplace_back(std::string(ftqp_arm_joints[i]) + "/position", &sent[i]);
        states.emplace_back(std::string(ftqp_arm_joints[i]) + "/position", &q[i]);
    }
    controller.init("ftqp", 1000);
    if (controller.on_configure({}) != controller_interface::CallbackReturn::SUCCESS) return EXIT_FAILURE;
    controller.assign_interfaces(std::move(commands), std::move(states));
    if (controller.on_activate({}) != controller_interface::CallbackReturn::SUCCESS) return EXIT_FAILURE;

    Wire wire(domain);
    auto &node = *controller.get_node();
    wire.hear<PoseStamped>("target", "geometry_msgs::msg::dds_::PoseStamped_", node);
    wire.hear<KeyValue>("fault", "diagnostic_msgs::msg::dds_::KeyValue_", node);
    wire.hear<std_msgs::msg::String>("withdraw", "std_msgs::msg::dds_::String_", node);
    auto *status = wire.writer(
        wire.topic<DiagnosticStatus>("rt/ftqp/status", "diagnostic_msgs::msg::dds_::DiagnosticStatus_"));

    using clock = std::chrono::steady_clock;
    auto due = clock::now(), before = due;
    const auto end = due + std::chrono::duration<double>(seconds);
    for (int said = 0; clock::now() < end;) {
        wire.listen();
        const auto now = clock::now();
        const double period = std::chrono::duration<double>(now - before).count();
        before = now;
        controller.update(rclcpp::Time(), rclcpp::Duration::from_seconds(period));
        for (int i = 0; i < FTQP_ARM_JOINTS; i++) q[i] = sent[i];
        const auto &published = node.published<DiagnosticStatus>("~/status");
        if (published.count != said) {
            said = published.count;
            DiagnosticStatus message = published.last;
            status->write(&message);
        }
        due += std::chrono::duration_cast<clock::duration>(std::chrono::duration<double>(FTQP_ARM_DT));
        std::this_thread::sleep_until(due);
    }
    return EXIT_SUCCESS;
}
