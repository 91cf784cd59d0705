fivepipe_test(schema_idl_test schema_idl.cpp LINK fivepipe_schema)
fivepipe_test(schema_cdr_test schema_cdr.cpp LINK fivepipe_schema)
fivepipe_test(schema_yaml_test schema_yaml.cpp LINK fivepipe_schema yaml-cpp)
fivepipe_test(schema_cyclone_test schema_cyclone.cpp LINK fivepipe_schema fivepipe_idl CycloneDDS::ddsc)
