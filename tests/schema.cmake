fivepipe_test(schema_idl_test schema_idl.cpp LINK fivepipe_schema)
