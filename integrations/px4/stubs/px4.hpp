// Stub of PX4's platform and of uORB, for one thread and one module.
#pragma once

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#define MODULE_NAME "gyrfalcon_control"
#define __EXPORT
#define PX4_OK 0
#define PX4_ERROR (-1)

namespace stub
{

// What the module printed last.
extern char printed[512];
// Time of hrt_absolute_time (us).
extern uint64_t now;

struct Topic {
	unsigned char data[256];
	unsigned published;
};

template<typename T>
void put(Topic &topic, const T &message)
{
	static_assert(sizeof(T) <= sizeof(topic.data), "a larger message");
	memcpy(topic.data, &message, sizeof(T));
	topic.published++;
}

template<typename T>
T get(const Topic &topic)
{
	T message;
	memcpy(&message, topic.data, sizeof(T));
	return message;
}

} // namespace stub

#define STUB_PRINT(...) snprintf(stub::printed, sizeof stub::printed, __VA_ARGS__)
#define PX4_INFO(...) STUB_PRINT(__VA_ARGS__)
#define PX4_WARN(...) STUB_PRINT(__VA_ARGS__)
#define PX4_ERR(...) STUB_PRINT(__VA_ARGS__)
#define PRINT_MODULE_DESCRIPTION(TEXT) STUB_PRINT("%s", TEXT)
#define PRINT_MODULE_USAGE_NAME(NAME, CATEGORY)
#define PRINT_MODULE_USAGE_COMMAND(NAME)
#define PRINT_MODULE_USAGE_DEFAULT_COMMANDS()

inline uint64_t hrt_absolute_time()
{
	return stub::now;
}

namespace px4
{

namespace wq_configurations
{
constexpr int nav_and_controllers = 0;
}

class WorkItem
{
public:
	WorkItem(const char *, int) {}
	virtual ~WorkItem() = default;
	virtual void Run() = 0;
};

} // namespace px4

// Holder of the one instance of a module.
template<typename T>
struct StubObject {
	T *held{nullptr};
	void store(T *object) { held = object; }
	T *load() const { return held; }
};

template<class T>
class ModuleBase
{
public:
	virtual ~ModuleBase() = default;
	virtual int print_status() { return 0; }

	static int main(int argc, char *argv[])
	{
		if (argc > 1 && strcmp(argv[1], "start") == 0) {
			return T::task_spawn(argc - 1, argv + 1);
		}

		if (argc > 1 && strcmp(argv[1], "status") == 0 && _object.load() != nullptr) {
			return _object.load()->print_status();
		}

		if (argc > 1 && strcmp(argv[1], "stop") == 0 && _object.load() != nullptr) {
			_object.load()->_exit = true;
			return PX4_OK;
		}

		return T::custom_command(argc - 1, argv + 1);
	}

	static T *stub_instance() { return _object.load(); }

protected:
	bool should_exit() const { return _exit; }

	static void exit_and_cleanup()
	{
		delete _object.load();
		_object.store(nullptr);
		_task_id = -1;
	}

	static constexpr int task_id_is_work_queue = -2;
	static StubObject<T> _object;
	static int _task_id;
	bool _exit{false};
};

template<class T>
StubObject<T> ModuleBase<T>::_object;
template<class T>
int ModuleBase<T>::_task_id = -1;

#define ORB_ID(NAME) (&stub::topic_##NAME)

namespace uORB
{

class Subscription
{
public:
	explicit Subscription(stub::Topic *topic) : _topic(topic) {}

	template<typename T>
	bool update(T *message)
	{
		if (_topic->published == _seen) {
			return false;
		}

		_seen = _topic->published;
		*message = stub::get<T>(*_topic);
		return true;
	}

private:
	stub::Topic *_topic;
	unsigned _seen{0};
};

class SubscriptionCallbackWorkItem : public Subscription
{
public:
	SubscriptionCallbackWorkItem(px4::WorkItem *, stub::Topic *topic) : Subscription(topic) {}
	bool registerCallback() { return true; }
	void unregisterCallback() {}
};

template<typename T>
class Publication
{
public:
	explicit Publication(stub::Topic *topic) : _topic(topic) {}

	bool publish(const T &message)
	{
		stub::put(*_topic, message);
		return true;
	}

private:
	stub::Topic *_topic;
};

} // namespace uORB

typedef uintptr_t param_t;
constexpr param_t PARAM_INVALID = UINTPTR_MAX;
param_t param_find(const char *name);
int param_get(param_t handle, float *value);
