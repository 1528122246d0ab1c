"""The diagnosis of a published table of mu and tau0."""
