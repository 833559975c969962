"""What a person looks at after a bake: contact sheets."""
