# The Modbus server against libmodbus and an echo server; run through ./dev bench.
add_executable(modbus_bench modbus_bench.cc modbus_load.cc modbus_servers.cc)
target_link_libraries(modbus_bench PRIVATE modbus PkgConfig::MODBUS CLI11::CLI11
  nlohmann_json::nlohmann_json Threads::Threads)
# That it runs is a test; what it measures is not.
add_test(NAME modbus_bench_runs COMMAND modbus_bench --quick)
set_tests_properties(modbus_bench_runs PROPERTIES LABELS "bench;slow" TIMEOUT 120 RUN_SERIAL ON)
