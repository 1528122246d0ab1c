"""The diagnosis of a campaign without the spring-block model: what friction varies with beside the load."""
